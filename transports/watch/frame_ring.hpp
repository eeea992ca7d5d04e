// SPDX-License-Identifier: Apache-2.0
// Writer of a frame ring in sealed shared memory.
#pragma once

#include "core/io/file_descriptor.hpp"
#include "transports/watch/frame_ring_layout.hpp"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace obscura::transports {

/// Owns the memory and the only mapping that may be written: the seals refuse any other, and a change of the
/// size, to all processes. Readers take no lock, so that one that is stopped or killed holds up nothing; what
/// they read while it is overwritten they throw away. Thread-bound, but for descriptor() and hand_over().
class FrameRing {
public:
    static constexpr std::size_t slots = 4;
    /// Readers that are told of a new frame; who comes later replaces the first of them.
    static constexpr std::size_t max_reported = 8;

    /// For frames of at most `max_pixels`; pages the memory in. Throws HardwareError.
    explicit FrameRing(std::size_t max_pixels);
    ~FrameRing();
    FrameRing(const FrameRing&) = delete;
    FrameRing& operator=(const FrameRing&) = delete;

    /// The memory, for readers; valid while this lives.
    [[nodiscard]] int descriptor() const noexcept { return memory_.get(); }
    /// A new eventfd, valid as descriptor(), that becomes readable with each frame. Throws HardwareError.
    /// Thread-bound, to another thread than write() if need be.
    [[nodiscard]] int hand_over();

    /// Copies a frame that has ended, with zeros for rows that are not there, and returns its serial number;
    /// 0: it has more pixels than fit. Does not block, allocate or throw.
    std::uint64_t write(const Frame& frame, std::uint64_t number) noexcept;

private:
    [[nodiscard]] FrameRingHead& head() const noexcept;

    FileDescriptor memory_;
    std::size_t bytes_ = 0;
    std::byte* mapped_ = nullptr;
    std::uint64_t serial_ = 0;
    /// Eventfds of told readers. Their numbers stay the same while the ring lives, so that write() may use
    /// them at any time; a new reader gets a new eventfd under the number of an old one.
    std::array<FileDescriptor, max_reported> told_;
    std::atomic<std::size_t> told_count_{0};
    std::size_t next_told_ = 0;
};

} // namespace obscura::transports
