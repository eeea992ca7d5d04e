// SPDX-License-Identifier: Apache-2.0
#include "renderer/frame_times.hpp"

#include "core/error.hpp"
#include "models/kinds/timing_program.hpp"
#include "renderer/renderer.hpp"

#include <algorithm>

namespace obscura::renderer {

FrameTimes frame_times(const scene::Camera& camera, const Region& window, RowTime exposure) {
    FrameTimes times;
    times.rows.assign(static_cast<std::size_t>(window.height), exposure);
    if (camera.timing != nullptr) {
        // An instant lasts 1 ns.
        const models::TimedFrame frame{camera.height, camera.width,
                                       std::max<std::int64_t>(exposure.exposure_ns(), 1)};
        if (const std::string why = camera.timing->explain(frame); !why.empty())
            throw ConfigError("camera: shutter: " + why);
        camera.timing->fill_rows(frame, window.y, times.rows);
        for (RowTime& row : times.rows)
            row = {exposure.reset + row.reset.ns, exposure.reset + row.read.ns};
        times.pixels = pixel_times_of(camera.timing.get());
        times.pixels.trigger = exposure.reset;
        times.pixels.rows = frame.rows;
        times.pixels.columns = frame.columns;
        times.pixels.exposure_ns = frame.exposure_ns;
    }
    times.common_mid = common_mid(times.rows);
    return times;
}

void fill_middles(const FrameTimes& times, const Region& window, std::int32_t row, std::span<float> out) {
    const auto seconds = [](const RowTime& t) { return static_cast<float>(to_seconds(t.mid().ns)); };
    if (!times.pixels) {
        std::fill(out.begin(), out.end(), seconds(times.rows[static_cast<std::size_t>(row)]));
        return;
    }
    std::vector<RowTime> pixels(out.size());
    times.pixels.fill(window.y + row, window.x, pixels);
    std::transform(pixels.begin(), pixels.end(), out.begin(), seconds);
}

} // namespace obscura::renderer
