// SPDX-License-Identifier: Apache-2.0
// Chunk data of a received frame: times, windows and the ground truth of the scene, as cards and JSON.
#pragma once

#include "core/camera/frame_record.hpp"
#include "core/camera/scene_truth.hpp"
#include "images/writers/card.hpp"

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace obscura::tools {

/// Contents of the chunks. Instants are device time (GigE Vision time stamps).
struct FrameChunks : FrameHead {
    std::vector<FrameWindow> windows; ///< with flags that include window_saturated
    std::vector<std::uint32_t> regions;
    std::vector<RowTime> rows;
    GroundTruth truth;
    SceneTruth truth_table; ///< entries only
    FrameQuality quality;
};

/// Reads the chunks; `chunk(id)` returns the bytes of a chunk, empty if the frame does not carry it. Throws
/// InputError if a chunk is missing or shorter than its contents.
[[nodiscard]] FrameChunks
parse_chunks(const std::function<std::span<const std::uint8_t>(std::uint32_t id)>& chunk);

/// The chunks as cards, with the keys of images::frame_cards() where the contents are the same.
[[nodiscard]] images::Cards chunk_cards(const FrameChunks& chunks);

/// One line of JSON, without line end: the chunks of the frame in `file`, named as in docs/gige.md.
[[nodiscard]] std::string chunk_json(const FrameChunks& chunks, const std::string& file);

} // namespace obscura::tools
