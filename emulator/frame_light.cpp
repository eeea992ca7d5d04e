// SPDX-License-Identifier: Apache-2.0
#include "emulator/frame_light.hpp"

#include <algorithm>

namespace obscura::emulator {

std::optional<std::int64_t> FrameLight::later_than(const FrameLight& other) const noexcept {
    if (renderer != other.renderer || frame_id != other.frame_id || live != other.live ||
        push_broom != other.push_broom || windows != other.windows || blocks != other.blocks ||
        levels != other.levels || adapts != other.adapts || rows.size() != other.rows.size() ||
        common_mid.has_value() != other.common_mid.has_value() || rows.empty())
        return std::nullopt;
    const std::int64_t later_ns = rows.front().reset - other.rows.front().reset;
    const auto shifted = [later_ns](const RowTime& a, const RowTime& b) {
        return a.reset - b.reset == later_ns && a.read - b.read == later_ns;
    };
    if (!std::equal(rows.begin(), rows.end(), other.rows.begin(), shifted)) return std::nullopt;
    return later_ns;
}

std::optional<Region> FrameLight::area() const noexcept {
    if (windows.size() != 1 || push_broom || blocks.empty()) return std::nullopt;
    const RowBlock& first = blocks.front();
    const Region& sensor = windows.front().sensor;
    return Region{sensor.x - first.halo_left, sensor.y - first.halo_above, width(first),
                  first.halo_above + static_cast<std::int32_t>(rows.size()) + blocks.back().halo_below};
}

BlockRenderer::BlockRenderer(std::size_t bands, std::int32_t lines, std::int32_t width) {
    times_.reserve(static_cast<std::size_t>(lines));
    levels_.reserve(static_cast<std::size_t>(lines));
    line_.resize(bands * static_cast<std::size_t>(width));
}

bool BlockRenderer::render(const FrameLight& light, const RowBlock& block, std::span<float> out,
                           const std::atomic<bool>* cancel) {
    const FrameLight::Window& window = light.windows[block.window];
    const std::int32_t first = block.first_row - block.halo_above; // of the composed image
    const std::int32_t last_row = window.image_y + window.sensor.height - 1;
    times_.clear();
    for (std::int32_t row = first; row < first + block.lines(); ++row)
        times_.push_back(light.rows[static_cast<std::size_t>(std::clamp(row, window.image_y, last_row))]);

    renderer::RenderRequest request;
    request.window.x = window.sensor.x - block.halo_left;
    request.window.width = light.width(block);
    request.frame_id = light.frame_id;
    if (light.push_broom) return render_push_broom(light, block, request, out, cancel);
    request.window.y = window.sensor.y + first - window.image_y;
    request.window.height = request.rows = block.lines();
    request.row_times = times_;
    request.common_mid = light.common_mid;
    request.keep = light.keep;
    request.from = light.from;
    if (!light.levels.empty()) {
        const std::int32_t group_rows =
            FrameQuality::group_rows_for(static_cast<std::int32_t>(light.rows.size()));
        levels_.clear();
        for (std::int32_t row = first; row < first + block.lines(); ++row)
            levels_.push_back(light.levels[static_cast<std::size_t>(
                std::clamp(row, window.image_y, last_row) / group_rows)]);
        request.levels = levels_;
        request.frame_times = std::span(light.rows)
                                  .subspan(static_cast<std::size_t>(window.image_y),
                                           static_cast<std::size_t>(window.sensor.height));
        request.frame_y = window.sensor.y;
    }
    return light.renderer->render(request, out, cancel);
}

bool BlockRenderer::render_push_broom(const FrameLight& light, const RowBlock& block,
                                      renderer::RenderRequest request, std::span<float> out,
                                      const std::atomic<bool>* cancel) {
    const auto line = static_cast<std::size_t>(request.window.width);
    const auto rows = static_cast<std::size_t>(block.rows);
    const std::size_t bands = light.renderer->band_count();
    request.window.y = light.windows[block.window].sensor.y;
    request.window.height = request.rows = 1;
    for (std::size_t r = 0; r < rows; ++r) {
        request.row_times = std::span(times_).subspan(r, 1);
        if (!light.renderer->render(request, {line_.data(), bands * line}, cancel)) return false;
        for (std::size_t b = 0; b < bands; ++b)
            std::copy_n(line_.begin() + static_cast<std::ptrdiff_t>(b * line), line,
                        out.begin() + static_cast<std::ptrdiff_t>((b * rows + r) * line));
    }
    return true;
}

} // namespace obscura::emulator
