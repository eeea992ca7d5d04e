// SPDX-License-Identifier: Apache-2.0
// Rows whose pixels have times of their own: they are rendered in parts of one time each.
#pragma once

#include "renderer/passes/row_pass.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace obscura::renderer {

/// Image motion between the pixels of a part of a row that are rendered at one time, px: none is farther from
/// its own time than half of it.
constexpr double max_part_motion_px = 1.0 / 256;

/// The one time of pixels whose exposures are equally long and between the middles of which nothing moves
/// much; nothing: there is none.
[[nodiscard]] std::optional<RowTime> common_time(const BuiltScene& built, std::span<const RowTime> pixels);

/// Calls `use(first, end, time)` for the parts of the columns [x, x + width) of row `y` of the sensor, in
/// their order. What a pixel's time is does not depend on which columns are asked for.
template<typename Use>
void for_parts(const BuiltScene& built, const PixelTimes& times, std::int32_t x, std::int32_t width,
               std::int32_t y, const Use& use) {
    std::array<RowTime, packet_size> pixels;
    std::int32_t first = x;
    std::optional<RowTime> pending;
    const auto add = [&](std::int32_t begin, const RowTime& time) {
        if (pending && *pending != time) {
            use(first, begin, *pending);
            first = begin;
        }
        pending = time;
    };
    const auto block_of = [](std::int32_t column) {
        return (column >= 0 ? column : column - packet_size + 1) / packet_size * packet_size;
    };
    for (std::int32_t block = block_of(x); block < x + width; block += packet_size) {
        times.fill(y, block, pixels);
        if (const auto common = common_time(built, pixels)) {
            add(std::max(block, x), *common);
            continue;
        }
        for (std::int32_t i = 0; i < packet_size; ++i)
            if (block + i >= x && block + i < x + width) add(block + i, pixels[static_cast<std::size_t>(i)]);
    }
    if (pending) use(first, x + width, *pending);
}

/// From the earliest reset to the latest read of each row of the request, in RowBlock::spans.
void fill_spans(const PassRequest& request, RowBlock& rows);

/// As render_row(), for a request with PixelTimes.
RenderedRow render_scanned_row(const BuiltScene& built, const PassRequest& request, const RowBlock& rows,
                               std::int32_t r, std::span<float> irradiance, Scratch& s);

/// As Renderer::render_aovs(), for row `r` of such a request.
void trace_scanned_aovs(const BuiltScene& built, const RenderRequest& request, std::int32_t r,
                        std::span<float> aovs, Scratch& s);

} // namespace obscura::renderer
