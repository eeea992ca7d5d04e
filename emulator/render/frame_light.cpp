// SPDX-License-Identifier: Apache-2.0
#include "emulator/render/frame_light.hpp"

#include "emulator/render/render_faults.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::emulator {
namespace {

/// Group size of frames of at most 65536 rows.
constexpr std::int32_t largest_group_rows = FrameQuality::group_rows_for(65536);

} // namespace

renderer::PixelTimes pixel_times_of(const sensors::ReadoutPlan& plan, std::size_t window, Time trigger,
                                    double rate) noexcept {
    if (plan.pixel_timing == nullptr) return {};
    const sensors::TimedWindow& timed = plan.timed_windows[window];
    renderer::PixelTimes times;
    times.timing = plan.pixel_timing;
    times.trigger = trigger;
    times.rate = rate;
    times.rows = timed.region.height;
    times.columns = timed.region.width;
    times.exposure_ns = timed.exposure_ns;
    times.x = timed.region.x;
    times.y = timed.region.y;
    return times;
}

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
    const auto same_pixels = [later_ns](renderer::PixelTimes a, const renderer::PixelTimes& b) {
        a.trigger += -later_ns;
        return a == b;
    };
    if (!std::equal(pixel_times.begin(), pixel_times.end(), other.pixel_times.begin(),
                    other.pixel_times.end(), same_pixels))
        return std::nullopt;
    return later_ns;
}

renderer::KeptWindow FrameLight::kept_window(std::size_t window) const noexcept {
    const Region& sensor = windows[window].sensor;
    const auto of_window = [window](const RowBlock& block) { return block.window == window; };
    const auto first = std::find_if(blocks.begin(), blocks.end(), of_window);
    const auto end = std::find_if_not(first, blocks.end(), of_window);
    if (first == end) return {};
    const Region area{sensor.x - first->halo_left, sensor.y - first->halo_above, width(*first),
                      first->halo_above + sensor.height + (end - 1)->halo_below};
    if (push_broom) return {{area.x, 0, area.width, sensor.height}, sensor.y};
    return {area, std::nullopt};
}

BlockRenderer::BlockRenderer(std::int32_t lines) {
    // Groups of rows reach beyond the block.
    const auto rows = static_cast<std::size_t>(lines + 2 * largest_group_rows);
    times_.reserve(rows);
    levels_.reserve(rows);
    row_px_.reserve(rows);
    group_px_.reserve(max_quality_groups);
}

renderer::RenderRequest BlockRenderer::request_for(const FrameLight& light, std::size_t window,
                                                   std::int32_t first_row, std::int32_t rows) {
    const FrameLight::Window& of = light.windows[window];
    const std::int32_t last_row = of.image_y + of.sensor.height - 1;
    times_.clear();
    for (std::int32_t row = first_row; row < first_row + rows; ++row)
        times_.push_back(light.rows[static_cast<std::size_t>(std::clamp(row, of.image_y, last_row))]);
    renderer::RenderRequest request;
    request.rows = rows;
    request.row_times = times_;
    request.frame_id = light.frame_id;
    request.frame_times =
        std::span(light.rows)
            .subspan(static_cast<std::size_t>(of.image_y), static_cast<std::size_t>(of.sensor.height));
    request.keep = light.keep;
    request.from = light.from;
    request.kept_window = window;
    if (!light.pixel_times.empty()) request.pixel_times = light.pixel_times[window];
    if (light.push_broom) {
        request.window.y = of.sensor.y;
        request.window.height = 1;
        request.line = first_row - of.image_y;
    } else {
        request.window.y = of.sensor.y + first_row - of.image_y;
        request.window.height = rows;
        request.common_mid = light.common_mid;
        request.frame_y = of.sensor.y;
    }
    return request;
}

bool BlockRenderer::render(const FrameLight& light, const RowBlock& block, std::span<float> out,
                           const std::atomic<bool>* cancel, const Extra& extra) {
    const FrameLight::Window& window = light.windows[block.window];
    const std::int32_t first = block.first_row - block.halo_above; // of the composed image
    const std::int32_t last_row = window.image_y + window.sensor.height - 1;
    renderer::RenderRequest request = request_for(light, block.window, first, block.lines());
    request.window.x = window.sensor.x - block.halo_left;
    request.window.width = light.width(block);
    request.alone = extra.alone;
    request.samples = extra.samples;
    // Lines have no other levels than those of rows made of another frame.
    if (!light.levels.empty() && (!light.push_broom || light.from != nullptr)) {
        const std::int32_t group_rows =
            FrameQuality::group_rows_for(static_cast<std::int32_t>(light.rows.size()));
        levels_.clear();
        for (std::int32_t row = first; row < first + block.lines(); ++row)
            levels_.push_back(light.levels[static_cast<std::size_t>(
                std::clamp(row, window.image_y, last_row) / group_rows)]);
        request.levels = levels_;
    }
    const std::uint64_t faults = light.faults != nullptr ? light.faults->count() : 0;
    if (render_noting(*light.renderer, request, out, cancel, light.faults)) return true;
    if (light.faults == nullptr || light.faults->count() == faults) return false;
    std::fill(out.begin(), out.end(), 0.0F); // the frame goes on, black and flagged
    return true;
}

bool BlockRenderer::choose_levels(FrameLight& light, const RowBlock& block, double tolerance_px,
                                  std::size_t& chosen, const std::atomic<bool>* cancel) {
    const auto height = static_cast<std::int32_t>(light.rows.size());
    const std::int32_t group_rows = FrameQuality::group_rows_for(height);
    const FrameLight::Window& own = light.windows[block.window];
    const std::int32_t needed =
        std::min(block.first_row + block.rows + block.halo_below, own.image_y + own.sensor.height);
    const auto end = static_cast<std::size_t>((needed + group_rows - 1) / group_rows);
    if (end <= chosen) return true;
    const std::int32_t begin_row = static_cast<std::int32_t>(chosen) * group_rows;
    const std::int32_t end_row = std::min(static_cast<std::int32_t>(end) * group_rows, height);
    group_px_.assign(end - chosen, 0.0F);
    // A group may have rows of several windows.
    for (std::size_t w = 0; w < light.windows.size(); ++w) {
        const FrameLight::Window& window = light.windows[w];
        const std::int32_t first = std::max(begin_row, window.image_y);
        const std::int32_t rows = std::min(end_row, window.image_y + window.sensor.height) - first;
        if (rows <= 0) continue;
        row_px_.resize(static_cast<std::size_t>(rows));
        try {
            if (!light.renderer->kept_motion_px(request_for(light, w, first, rows), row_px_, cancel))
                return false;
        } catch (...) {
            if (light.faults == nullptr) throw;
            light.faults->note(light.frame_id);
            return false;
        }
        for (std::int32_t r = 0; r < rows; ++r) {
            float& px = group_px_[static_cast<std::size_t>((first + r - begin_row) / group_rows)];
            px = std::max(px, row_px_[static_cast<std::size_t>(r)]);
        }
    }
    for (std::size_t g = chosen; g < end; ++g) {
        const float px = group_px_[g - chosen];
        light.levels[g] = static_cast<double>(px) <= tolerance_px ? QualityLevel::repeated
                          : std::isinf(px)                        ? QualityLevel::full
                                                                  : QualityLevel::reprojected;
    }
    chosen = end;
    return true;
}

} // namespace obscura::emulator
