// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/device/region_binning.hpp"

#include "transports/gige/device/stream_channel.hpp"

#include <algorithm>

namespace obscura::transports::gige {
namespace {

/// Rounds `at` and `length` down to whole steps of binned pixels, within the extent and `pixels`.
void fit(std::int32_t& at, std::int32_t& length, std::int32_t pixels, const BinnedExtent& e,
         std::int32_t binning) {
    const std::int32_t step = e.step * binning;
    length = std::clamp(length / step * step, e.minimum * binning, e.maximum * binning);
    at = std::max(0, std::min(at, pixels - length) / step * step);
}

} // namespace

BinnedExtent binned_columns(const DeviceContext& d, const Binning& binning) {
    return binned_extent(d.limits.sensor_width, d.limits.width_min, d.limits.width_step, binning.horizontal);
}

BinnedExtent binned_rows(const DeviceContext& d, const Binning& binning) {
    return binned_extent(d.limits.sensor_height, d.limits.height_min, d.limits.height_step, binning.vertical);
}

Status write_binning(DeviceContext& d, const Binning& wanted) {
    const auto possible = [](std::int32_t n) { return n == 1 || n == 2 || n == 4; };
    if (!possible(wanted.horizontal) || !possible(wanted.vertical)) return Status::invalid_parameter;
    const BinnedExtent x = binned_columns(d, wanted);
    const BinnedExtent y = binned_rows(d, wanted);
    if (x.maximum < x.minimum || y.maximum < y.minimum) return Status::invalid_parameter; // a tiny sensor
    CameraSettings s = d.control.settings();
    if (wanted.active() && (multipart(d) || s.more_count > 0 || s.sampling == Sampling::non_destructive))
        return Status::write_protect;
    if (wanted.active()) {
        fit(s.region.x, s.region.width, d.limits.sensor_width, x, wanted.horizontal);
        fit(s.region.y, s.region.height, d.limits.sensor_height, y, wanted.vertical);
        if (apply_settings(d, s) != Status::success) return Status::invalid_parameter;
    }
    d.binning = wanted;
    return Status::success;
}

} // namespace obscura::transports::gige
