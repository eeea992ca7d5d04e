// SPDX-License-Identifier: Apache-2.0
#include "emulator/unit/render_speed.hpp"

#include <algorithm>
#include <vector>

namespace obscura::emulator {
namespace {

/// Parts in which the frame is rendered: slabs of AdaptiveFrame.
constexpr std::int32_t parts = 8;
constexpr std::int64_t max_ns = 2 * ns_per_s;
/// Share of the period that a reserve may take.
constexpr std::int64_t period_parts = 10;

} // namespace

std::optional<std::int64_t> frame_time_ns(const renderer::Renderer& renderer,
                                          const renderer::RenderRequest& frame, const Clock& clock,
                                          const std::function<bool(double)>& go_on) {
    std::vector<float> light(renderer.band_count() * static_cast<std::size_t>(frame.rows) *
                             static_cast<std::size_t>(frame.window.width));
    const Time begin = clock.now();
    for (std::int32_t part = 0; part < parts; ++part) {
        if (!go_on(static_cast<double>(part) / parts)) return std::nullopt;
        renderer::RenderRequest some = frame;
        some.first_row = frame.rows * part / parts;
        some.rows = frame.rows * (part + 1) / parts - some.first_row;
        if (some.rows == 0) continue;
        some.row_times = frame.row_times.subspan(static_cast<std::size_t>(some.first_row),
                                                 static_cast<std::size_t>(some.rows));
        static_cast<void>(renderer.render(some, light));
        if (const std::int64_t spent_ns = clock.now() - begin; spent_ns > max_ns)
            return spent_ns * parts / (part + 1);
    }
    return clock.now() - begin;
}

std::int64_t reserve_for(std::int64_t frame_ns, std::int64_t period_ns, std::int64_t at_least_ns) noexcept {
    const std::int64_t slab_ns = frame_ns / parts;
    return std::max(at_least_ns, period_ns > 0 ? std::min(slab_ns, period_ns / period_parts) : slab_ns);
}

} // namespace obscura::emulator
