// SPDX-License-Identifier: Apache-2.0
#include "emulator/unit/render_speed.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <span>
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
    std::atomic<bool> cancel{false};
    std::atomic<std::int32_t> done{0};
    auto measured = std::async(std::launch::async, [&]() -> std::optional<std::int64_t> {
        std::vector<float> light(renderer.band_count() * static_cast<std::size_t>(frame.rows) *
                                 static_cast<std::size_t>(frame.window.width));
        const Time begin = clock.now();
        for (; done < parts; ++done) {
            renderer::RenderRequest some = frame;
            some.first_row = frame.rows * done / parts;
            some.rows = frame.rows * (done + 1) / parts - some.first_row;
            if (some.rows == 0) continue;
            some.row_times = frame.row_times.subspan(static_cast<std::size_t>(some.first_row),
                                                     static_cast<std::size_t>(some.rows));
            const std::size_t floats = renderer.band_count() * static_cast<std::size_t>(some.rows) *
                                       static_cast<std::size_t>(frame.window.width);
            static_cast<void>(renderer.render(some, std::span(light).first(floats), &cancel));
            if (cancel) return std::nullopt;
            if (const std::int64_t spent_ns = clock.now() - begin; spent_ns > max_ns)
                return spent_ns * parts / (done + 1);
        }
        return clock.now() - begin;
    });
    do {
        if (!go_on(static_cast<double>(done) / parts)) cancel = true;
    } while (measured.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready);
    return measured.get();
}

std::int64_t reserve_for(std::int64_t frame_ns, std::int64_t period_ns, std::int64_t at_least_ns) noexcept {
    const std::int64_t slab_ns = frame_ns / parts;
    return std::max(at_least_ns, period_ns > 0 ? std::min(slab_ns, period_ns / period_parts) : slab_ns);
}

} // namespace obscura::emulator
