// SPDX-License-Identifier: Apache-2.0
// Payload of one GVSP block: pixels in wire format as rows become ready, then chunks, divided into packets.
#pragma once

#include "core/camera/frame.hpp"
#include "transports/gige/channels/binning.hpp"
#include "transports/gige/channels/chunk_data.hpp"
#include "transports/gige/wire/payload_part.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace obscura::transports::gige {

/// Payload options that a client chose for its stream, and size limits.
struct PayloadFormat {
    bool multipart = false;    ///< one part per sensor window instead of the composed image
    bool packs_pixels = false; ///< the pixel format differs from that of a Frame
    std::uint32_t chunks = 0;  ///< selection, see Chunk
    std::size_t max_image_bytes = 0;
    std::int32_t max_width = 0, max_height = 0;
    std::int64_t timestamp_origin_ns = 0;
    RegionNumbers regions{};
    Binning binning;                 ///< inactive with multipart
    std::uint32_t truth_entries = 0; ///< room of the truth table's chunk
};

/// Pixels are not copied if the frame holds them in wire format; otherwise each row is packed once, when it
/// is ready. Thread-bound; only reserve() allocates.
class Payload {
public:
    using Part = PayloadPart;
    /// A range of the payload in up to three pieces of memory.
    using Pieces = std::array<std::span<const std::uint8_t>, 3>;

    void reserve(const PayloadFormat& format);
    /// Lays `frame` out for packets of `packet_bytes`. Returns false when it does not fit what was reserved.
    bool begin(const Frame& frame, std::uint64_t frame_id, std::size_t packet_bytes) noexcept;
    /// Adds the rows that have become ready since the last call; zeros follow an abandoned frame's last row.
    void update(const Frame& frame) noexcept;

    [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }
    [[nodiscard]] std::uint32_t packets() const noexcept { return packets_; }
    /// Packets [0, ready_packets()) may be sent.
    [[nodiscard]] std::uint32_t ready_packets() const noexcept;
    [[nodiscard]] std::span<const Part> parts() const noexcept { return {parts_.data(), part_count_}; }
    /// The part that holds packet `i`.
    [[nodiscard]] const Part& part_of(std::uint32_t i) const noexcept;
    /// Contents of packet `i`; `zeros` is at least packet_bytes of zeros. `offset` becomes their position in
    /// the payload.
    [[nodiscard]] Pieces packet(std::uint32_t i, std::span<const std::uint8_t> zeros,
                                std::size_t& offset) const noexcept;
    [[nodiscard]] std::uint32_t chunks() const noexcept { return format_.chunks; }
    [[nodiscard]] bool multipart() const noexcept { return format_.multipart; }
    /// The image as sent: offset of the first window, size of the whole image.
    [[nodiscard]] const Region& image() const noexcept { return image_; }

private:
    void append_row(const FrameInfo& info, std::span<const std::uint16_t> row) noexcept;
    void finish_part(const Frame& frame) noexcept;
    [[nodiscard]] bool done() const noexcept { return available_ == bytes_; }

    PayloadFormat format_;
    std::size_t packet_bytes_ = 0;
    std::uint64_t frame_id_ = 0;
    bool direct_ = false;
    Region image_;
    RowBinner binner_;
    const std::uint8_t* data_ = nullptr;
    std::size_t image_bytes_ = 0, bytes_ = 0;
    std::size_t valid_ = 0, available_ = 0; // image bytes that are pixels; payload bytes that may be sent
    std::uint32_t packets_ = 0;
    std::array<Part, max_parts> parts_{};
    std::size_t part_count_ = 0;
    // Packing: position of the next row.
    std::size_t packing_part_ = 0;
    std::int32_t packing_row_ = 0; // of the part
    std::size_t carried_ = 0;      // pixels in carry_ that do not yet fill whole bytes
    std::vector<std::uint8_t> packed_, chunk_store_;
    std::vector<std::uint16_t> carry_;
};

/// Bytes of the chunks of a payload: after an image of `rows` rows, or as the last part of a multi-part one.
[[nodiscard]] std::size_t chunk_payload_bytes(std::uint32_t chunks, std::int32_t rows, bool multipart,
                                              std::uint32_t truth_entries) noexcept;

} // namespace obscura::transports::gige
