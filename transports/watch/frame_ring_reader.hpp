// SPDX-License-Identifier: Apache-2.0
// Reader of a frame ring.
#pragma once

#include "core/io/file_descriptor.hpp"
#include "transports/watch/frame_ring_layout.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace obscura::transports {

/// A frame of the ring. `header` and `truth` are copies; `pixels`, header.width x header.height, row-major,
/// stand in the ring and may be overwritten while they are read: see FrameRingReader::intact().
struct RingFrame {
    std::uint64_t serial = 0; ///< larger for later frames of the same ring
    FrameRingHeader header;
    FrameRingTruth truth;
    std::span<const std::uint16_t> pixels;
};

/// Maps a ring for reading. Thread-safe.
class FrameRingReader {
public:
    /// Checks layout, size and seals. Throws InputError.
    explicit FrameRingReader(const FileDescriptor& ring);
    ~FrameRingReader();
    FrameRingReader(const FrameRingReader&) = delete;
    FrameRingReader& operator=(const FrameRingReader&) = delete;

    /// Serial number of the newest frame; 0: none.
    [[nodiscard]] std::uint64_t newest() const noexcept;
    /// The newest frame; none: there is none, or the writer was faster each time.
    [[nodiscard]] std::optional<RingFrame> read() const noexcept;
    /// The frame with that serial number; none: it has been overwritten, or is not there yet.
    [[nodiscard]] std::optional<RingFrame> read(std::uint64_t serial) const noexcept;
    /// Whether what has been read of the frame's pixels until now is of that frame.
    [[nodiscard]] bool intact(const RingFrame& frame) const noexcept;
    /// Copies all pixels to `out`, which has room for them. Returns whether they are of that frame.
    [[nodiscard]] bool copy(const RingFrame& frame, std::span<std::uint16_t> out) const noexcept;

private:
    [[nodiscard]] const std::byte* slot(std::uint64_t serial) const noexcept;

    std::size_t bytes_ = 0;
    const std::byte* mapped_ = nullptr;
    FrameRingHead head_; ///< private copy of the first state, which the writer cannot change
};

} // namespace obscura::transports
