// SPDX-License-Identifier: Apache-2.0
#include "renderer/pixel_times.hpp"

#include "models/kinds/timing_program.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::renderer {

PixelTimes pixel_times_of(const models::TimingProgram* timing) noexcept {
    PixelTimes times;
    if (timing != nullptr && timing->by_pixel()) times.timing = timing;
    return times;
}

RowTime PixelTimes::shown(const RowTime& after_trigger) const noexcept {
    const auto at = [this](Time t) {
        return trigger + (rate == 1 ? t.ns : std::llround(static_cast<double>(t.ns) * rate));
    };
    return {at(after_trigger.reset), at(after_trigger.read)};
}

void PixelTimes::fill(std::int32_t sensor_y, std::int32_t first_x, std::span<RowTime> times) const noexcept {
    timing->fill_pixels({rows, columns, exposure_ns}, sensor_y - y, first_x - x, times);
    std::transform(times.begin(), times.end(), times.begin(), [this](const RowTime& t) { return shown(t); });
}

RowTime PixelTimes::span_of(std::int32_t sensor_y) const noexcept {
    models::TimedRow all;
    timing->sum_up({rows, columns, exposure_ns}, sensor_y - y, all);
    return shown({all.first_reset, all.last_read});
}

} // namespace obscura::renderer
