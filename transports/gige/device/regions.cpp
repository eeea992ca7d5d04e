// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/device/regions.hpp"

#include "transports/gige/device/stream_channel.hpp"

#include <algorithm>

namespace obscura::transports::gige {
namespace {

CameraSettings with_regions(const DeviceContext& d, const CameraWindow& first) {
    std::array<CameraWindow, max_windows> windows;
    std::size_t n = 0;
    windows[n++] = first;
    for (std::uint32_t i = 1; i < region_count(d); ++i)
        if (d.regions[i].enabled) windows[n++] = d.regions[i].window;
    CameraSettings s = d.control.settings();
    s.set_windows({windows.data(), n});
    return s;
}

} // namespace

std::uint32_t region_count(const DeviceContext& d) noexcept {
    return std::clamp<std::uint32_t>(d.limits.windows_max, 1, max_windows);
}

CameraWindow region_window(const DeviceContext& d, std::uint32_t i) {
    return i == 0 ? d.control.settings().window(0) : d.regions[i].window;
}

Status write_region(DeviceContext& d, std::uint32_t i, const CameraWindow& window, bool enabled) {
    // A disabled region must be valid, too, as the only one.
    CameraSettings alone = d.control.settings();
    alone.set_windows({&window, 1});
    if (!explain_invalid(alone, d.limits).empty()) return Status::invalid_parameter;
    // Binning supports a single image of a single window.
    if (d.binning.active() && (i == 0 ? window.sampling == Sampling::non_destructive : enabled))
        return Status::write_protect;
    const DeviceContext::RegionSlot before = d.regions[i];
    const bool concerned = i == 0 || enabled || before.enabled;
    d.regions[i] = {enabled, window};
    if (concerned && !d.control.apply(with_regions(d, i == 0 ? window : region_window(d, 0)))) {
        d.regions[i] = before;
        return Status::invalid_parameter;
    }
    return Status::success;
}

FrameWindow region_obtained(DeviceContext& d, std::uint32_t i) {
    const ReadoutAnswer& answer = readout_answer(d);
    const auto& regions = d.regions;
    if (i > 0 && !regions[i].enabled) return {};
    // The sensor numbers the windows requested: Region0, then the enabled regions.
    const auto request =
        static_cast<std::uint32_t>(std::count_if(regions.begin() + 1, regions.begin() + std::max(i, 1U),
                                                 [](const auto& r) { return r.enabled; }) +
                                   (i > 0 ? 1 : 0));
    FrameWindow found;
    bool any = false;
    for (std::uint32_t w = 0; w < answer.window_count; ++w) {
        const FrameWindow& window = answer.windows[w];
        if (window.request != request) continue;
        if (!any) {
            found = window;
        } else { // further reads of the same window
            found.exposure_min_ns = std::min(found.exposure_min_ns, window.exposure_min_ns);
            found.exposure_max_ns = std::max(found.exposure_max_ns, window.exposure_max_ns);
            found.flags |= window.flags;
        }
        any = true;
    }
    return found;
}

ImageSize image_size(DeviceContext& d) {
    const ReadoutAnswer& answer = readout_answer(d);
    if (answer.window_count == 0) return composed_size(d.control.settings());
    ImageSize size;
    for (std::uint32_t w = 0; w < answer.window_count; ++w) {
        size.width = std::max(size.width, answer.windows[w].sensor.width);
        size.height += answer.windows[w].sensor.height;
    }
    return size;
}

bool is_composed(DeviceContext& d, std::uint32_t i) {
    return (i == 0 || d.regions[i].enabled) && !multipart(d) && readout_answer(d).window_count > 1;
}

Region region_read(DeviceContext& d, std::uint32_t i) {
    const Region obtained = region_obtained(d, i).sensor;
    return obtained.area() > 0 ? obtained : region_window(d, i).region;
}

void reset_regions(DeviceContext& d) {
    d.regions = {};
    const CameraSettings s = d.control.settings();
    for (std::uint32_t i = 1; i < max_windows; ++i) {
        d.regions[i].window.region = {0, 0, d.limits.width_min, d.limits.height_min};
        d.regions[i].window.exposure_ns = s.exposure_ns;
        if (i < s.window_count()) d.regions[i] = {true, s.window(i)};
    }
}

} // namespace obscura::transports::gige
