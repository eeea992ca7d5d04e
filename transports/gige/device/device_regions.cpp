// The part of Device that has regions: SFNC's name for the windows of the sensor.
#include "transports/gige/device/device.hpp"
#include "transports/gige/device/device_words.hpp"

#include <algorithm>

namespace obscura::transports::gige {

std::uint32_t Device::region_count() const noexcept {
    return std::clamp<std::uint32_t>(limits_.windows_max, 1, max_windows);
}

CameraWindow Device::region_window(std::uint32_t i) const {
    return i == 0 ? control_.settings().window(0) : regions_[i].window;
}

CameraSettings Device::with_regions(const CameraWindow& first) const {
    std::array<CameraWindow, max_windows> windows;
    std::size_t n = 0;
    windows[n++] = first;
    for (std::uint32_t i = 1; i < region_count(); ++i)
        if (regions_[i].enabled) windows[n++] = regions_[i].window;
    CameraSettings s = control_.settings();
    s.set_windows({windows.data(), n});
    return s;
}

Status Device::write_region(std::uint32_t i, const CameraWindow& window, bool enabled) {
    // A region that is off has to be possible, too, on its own.
    CameraSettings alone = control_.settings();
    alone.set_windows({&window, 1});
    if (!explain_invalid(alone, limits_).empty()) return Status::invalid_parameter;
    // What is binned is one picture of one window.
    if (binning_.active() && (i == 0 ? window.sampling == Sampling::non_destructive : enabled))
        return Status::write_protect;
    const RegionSlot before = regions_[i];
    const bool concerned = i == 0 || enabled || before.enabled;
    regions_[i] = {enabled, window};
    if (concerned && !control_.apply(with_regions(i == 0 ? window : region_window(0)))) {
        regions_[i] = before;
        return Status::invalid_parameter;
    }
    return Status::success;
}

FrameWindow Device::region_obtained(std::uint32_t i) {
    const ReadoutAnswer& answer = readout_answer();
    if (i > 0 && !regions_[i].enabled) return {};
    // The chip numbers what it was asked for: Region0, then those that are on.
    const auto request =
        static_cast<std::uint32_t>(std::count_if(regions_.begin() + 1, regions_.begin() + std::max(i, 1U),
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

void Device::reset_regions() {
    regions_ = {};
    const CameraSettings s = control_.settings();
    for (std::uint32_t i = 1; i < max_windows; ++i) {
        regions_[i].window.region = {0, 0, limits_.width_min, limits_.height_min};
        regions_[i].window.exposure_ns = s.exposure_ns;
        if (i < s.window_count()) regions_[i] = {true, s.window(i)};
    }
}

void Device::add_regions() {
    reset_regions();
    constant("RegionsMax", feature::regions_max, region_count());
    for (std::uint32_t i = 0; i < region_count(); ++i) {
        const std::uint32_t base = feature::regions + i * feature::region_stride;
        const auto part = [&](std::string_view name, std::uint32_t offset, bool locked,
                              std::function<std::uint32_t(const CameraWindow&)> get,
                              std::function<bool(CameraWindow&, std::uint32_t)> set) {
            bank_.add({.name = name,
                       .address = base + offset,
                       .access = Access::read_write,
                       .locked_while_streaming = locked,
                       .maximum = 0x7FFFFFFF,
                       .read = [this, i, get = std::move(get)] { return get(region_window(i)); },
                       .write =
                           [this, i, set = std::move(set)](std::uint32_t value) {
                               CameraWindow w = region_window(i);
                               if (!set(w, value)) return Status::invalid_parameter;
                               return write_region(i, w, regions_[i].enabled);
                           }});
        };
        const auto extent = [&](std::string_view name, std::uint32_t offset, bool locked,
                                std::int32_t Region::*member, std::int32_t Binning::*binning) {
            part(
                name, offset, locked,
                [this, i, member, binning](const CameraWindow& w) {
                    return static_cast<std::uint32_t>(w.region.*member / region_binning(i).*binning);
                },
                [this, i, member, binning](CameraWindow& w, std::uint32_t value) {
                    const std::int64_t pixels = std::int64_t{value} * (region_binning(i).*binning);
                    w.region.*member = static_cast<std::int32_t>(pixels);
                    return pixels <= INT32_MAX;
                });
        };
        // Width and height, and what else changes the size of the image, stay while streaming.
        extent("Width", feature::region::width, true, &Region::width, &Binning::horizontal);
        extent("Height", feature::region::height, true, &Region::height, &Binning::vertical);
        extent("OffsetX", feature::region::offset_x, false, &Region::x, &Binning::horizontal);
        extent("OffsetY", feature::region::offset_y, false, &Region::y, &Binning::vertical);
        bank_.add({.name = "RegionMode",
                   .address = base + feature::region::mode,
                   .access = Access::read_write,
                   .locked_while_streaming = true,
                   .minimum = i == 0 ? 1U : 0U, // the first cannot be switched off
                   .maximum = 1,
                   .read = [this, i] { return std::uint32_t{i == 0 || regions_[i].enabled}; },
                   .write =
                       [this, i](std::uint32_t value) {
                           return write_region(i, region_window(i), i > 0 && value == 1);
                       }});
        part(
            "RegionExposureTime", feature::region::exposure, false,
            [](const CameraWindow& w) { return time_units(w.exposure_ns); },
            [this, i](CameraWindow& w, std::uint32_t value) {
                w.exposure_ns = std::int64_t{value} * feature::time_unit_ns;
                return i > 0 || control_.settings().exposure_auto == ExposureAuto::off;
            });
        part(
            "RegionSampling", feature::region::sampling, true,
            [](const CameraWindow& w) { return static_cast<std::uint32_t>(w.sampling); },
            [](CameraWindow& w, std::uint32_t value) {
                if (value > static_cast<std::uint32_t>(Sampling::ramp)) return false;
                w.sampling = static_cast<Sampling>(value);
                // The fewest reads that make sense, as one cannot be set without the other.
                const bool difference = w.sampling == Sampling::cds || w.sampling == Sampling::ramp;
                w.reads = w.sampling == Sampling::destructive ? 1 : std::max(w.reads, difference ? 2 : 1);
                return true;
            });
        part(
            "RegionReads", feature::region::reads, true,
            [](const CameraWindow& w) { return static_cast<std::uint32_t>(w.reads); },
            [](CameraWindow& w, std::uint32_t value) {
                w.reads = static_cast<std::int32_t>(value);
                return true;
            });
        const auto obtained = [&](std::string_view name, std::uint32_t offset, auto get) {
            word(name, base + offset, 0,
                 [this, i, get] { return static_cast<std::uint32_t>(get(region_obtained(i))); });
        };
        obtained("RegionExposureTimeMin", feature::region::exposure_min,
                 [](const FrameWindow& w) { return time_units(w.exposure_min_ns); });
        obtained("RegionExposureTimeMax", feature::region::exposure_max,
                 [](const FrameWindow& w) { return time_units(w.exposure_max_ns); });
        obtained("RegionFlags", feature::region::flags, [](const FrameWindow& w) { return w.flags; });
        obtained("RegionObtainedX", feature::region::obtained_x,
                 [](const FrameWindow& w) { return w.sensor.x; });
        obtained("RegionObtainedY", feature::region::obtained_y,
                 [](const FrameWindow& w) { return w.sensor.y; });
        obtained("RegionObtainedWidth", feature::region::obtained_width,
                 [](const FrameWindow& w) { return w.sensor.width; });
        obtained("RegionObtainedHeight", feature::region::obtained_height,
                 [](const FrameWindow& w) { return w.sensor.height; });
        obtained("RegionImageY", feature::region::image_y, [](const FrameWindow& w) { return w.image_y; });
    }
}

} // namespace obscura::transports::gige
