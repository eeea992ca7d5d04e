// SPDX-License-Identifier: Apache-2.0
// Chunk data: metadata of a frame, appended to its pixels and read through the GenICam XML.
#pragma once

#include "core/camera/frame.hpp"
#include "transports/gige/channels/binning.hpp"
#include "transports/gige/wire/chunk.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace obscura::transports::gige {

/// Region number of each requested window; disabled regions leave gaps.
using RegionNumbers = std::array<std::uint8_t, max_windows>;

/// Bytes of the chunks in `selection` with their tags, the image's tag included; 0 for an empty selection.
/// `truth_entries`: that a truth table has room for.
[[nodiscard]] std::size_t chunk_bytes(std::uint32_t selection, std::int32_t rows,
                                      std::uint32_t truth_entries = 0) noexcept;

/// How a frame is sent.
struct ChunkContext {
    std::uint64_t frame_id = 0;
    std::size_t image_bytes = 0;
    bool tag_image = false;
    std::int64_t timestamp_origin_ns = 0; ///< device time is TAI minus this
    RegionNumbers regions{};
    Binning binning{};
    std::uint32_t truth_entries = 0; ///< that a truth table has room for
};

/// Writes the image's tag, where it has one, and the selected chunks; `out` has room for chunk_bytes(). The
/// reset of a binned row is that of its first sensor row, the readout that of the last; regions stay in
/// sensor pixels. Real-time safe.
std::size_t write_chunks(std::span<std::uint8_t> out, std::uint32_t selection, const Frame& frame,
                         const ChunkContext& context) noexcept;

} // namespace obscura::transports::gige
