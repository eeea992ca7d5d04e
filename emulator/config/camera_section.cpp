// SPDX-License-Identifier: Apache-2.0
#include "emulator/config/camera_section.hpp"

#include "core/camera/setting_ranges.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

namespace obscura::emulator {
namespace {

using config::key;

config::Section window_section(WindowSection& s) {
    const CameraLimits limits;
    config::Section section;
    section.help = "One of several windows that are read in one frame, in their order.";
    section.keys = {
        key("width", &s.width).unit("px").range(1, 65536).required().help("Width of the window"),
        key("height", &s.height)
            .unit("px")
            .range(1, 65536)
            .required()
            .help("Height of the window; push-broom sensors: number of lines"),
        key("offset_x", &s.offset_x)
            .unit("px")
            .range(0, 65535)
            .help("First column of the window on the sensor"),
        key("offset_y", &s.offset_y).unit("px").range(0, 65535).help("First row of the window on the sensor"),
        key("exposure_us", &s.exposure_us)
            .unit("us")
            .range(static_cast<double>(limits.exposure_min_ns) / 1e3,
                   static_cast<double>(limits.exposure_max_ns) / 1e3)
            .help("Integration time of the window; that of [camera] if not given"),
        key("sampling", &s.sampling)
            .help("Reads of the window. destructive: one sample and reset; non-destructive: each of several "
                  "reads without reset is delivered; cds: last read minus first; ramp: line fitted through "
                  "all reads"),
        key("reads", &s.reads)
            .range(any_reads_range.minimum, any_reads_range.maximum)
            .help("Number of reads of a window that is not read destructively"),
    };
    return section;
}

/// List of the windows; an exposure that is not given is that of [camera].
config::List window_list(CameraSection& s) {
    config::List windows =
        config::list("window", "One of several windows that are read in one frame, in their order.",
                     s.windows, window_section);
    windows.append = [&s](const config::Value& /*table*/) {
        WindowSection& window = s.windows.emplace_back();
        window.exposure_us = s.exposure_us;
        return window_section(window);
    };
    windows.examples = [] {
        static WindowSection example{.width = 64, .height = 64, .exposure_us = CameraSection{}.exposure_us};
        return std::vector{window_section(example)};
    };
    windows.least = 1;
    return windows;
}

} // namespace

config::Section section_of(CameraSection& s) {
    const CameraLimits limits;
    const bool composed = !s.windows.empty(); // the windows have the extents
    const auto unless_composed = [composed](config::Key key) {
        return composed ? std::move(key).unprinted() : std::move(key);
    };
    config::Section section;
    section.name = "camera";
    section.help =
        "Values that the features of the camera have after reset; clients change them over GigE Vision.";
    section.keys = {
        unless_composed(
            key("width", &s.width).unit("px").range(0, 65536).help("Width after reset; 0: the whole sensor")),
        unless_composed(key("height", &s.height)
                            .unit("px")
                            .range(0, 65536)
                            .help("Height after reset; 0: the whole sensor")),
        unless_composed(key("offset_x", &s.offset_x).unit("px").range(0, 65535).help("OffsetX after reset")),
        unless_composed(key("offset_y", &s.offset_y).unit("px").range(0, 65535).help("OffsetY after reset")),
        key("pixel_format", &s.pixel_format).help("PixelFormat after reset"),
        key("exposure_us", &s.exposure_us)
            .unit("us")
            .range(static_cast<double>(limits.exposure_min_ns) / 1e3,
                   static_cast<double>(limits.exposure_max_ns) / 1e3)
            .help("ExposureTime after reset"),
        key("gain_db", &s.gain_db)
            .unit("dB")
            .range(limits.gain_min_db, limits.gain_max_db)
            .help("Gain after reset"),
        key("trigger_mode", &s.trigger_mode, "On", "Off")
            .help("TriggerMode of FrameStart after reset; Off: free run"),
        key("trigger_source", &s.trigger_source)
            .choices({"Line0", "Line1", "Line2", "Line3", "Software", "Action1"})
            .help("TriggerSource of FrameStart after reset; Line0 is driven by [trigger], Line1 by "
                  "[trigger.line1]"),
        key("trigger_activation", &s.trigger_activation, "auto")
            .help("TriggerActivation of FrameStart after reset; auto: all edges that the line's source "
                  "reports"),
        key("exposure_mode", &s.exposure_mode)
            .help("ExposureMode after reset; TriggerWidth: the exposure lasts as long as the trigger pulse "
                  "(gpio, edge = \"both\")"),
        key("frame_rate_hz", &s.frame_rate_hz)
            .unit("Hz")
            .range(limits.frame_rate_min_hz, limits.frame_rate_max_hz)
            .help("AcquisitionFrameRate after reset, for free run and for level triggers"),
        key("readout_timing", &s.readout_timing)
            .help("Release of rows to the transports. sensor: when the chip reads them; fast: as soon as "
                  "they are rendered; triggers and exposures are those of the chip in both cases"),
        key("rows_max", &s.rows_max)
            .unit("px")
            .range(0, 1048576)
            .help("Largest number of rows of a composed image that a client may request; 0: as many as "
                  "sensor and windows need"),
    };
    section.lists = {window_list(s)};
    section.check = [&s](const config::ReadTable& table) {
        for (const std::string_view key : {"width", "height", "offset_x", "offset_y"})
            if (!s.windows.empty() && table.has(key))
                table.refuse(key, "not allowed beside [[camera.window]], which says it");
    };
    return section;
}

namespace {

/// Key and reason for which the sensor cannot read the window; both empty if it can. Windows may share rows:
/// the chip reads them, and flags of the frame report the result.
std::pair<std::string_view, std::string> explain_window(const WindowSection& w,
                                                        const ReadoutSettings& readout) {
    const bool lines = readout.shutter == Shutter::push_broom;
    const bool out_x = w.offset_x >= readout.width || w.width > readout.width - w.offset_x;
    const bool out_y = w.offset_y >= readout.height || (!lines && w.height > readout.height - w.offset_y);
    if (readout.strict && out_x)
        return {"width", fmt::format("columns {} to {} leave the sensor, which is {} px wide", w.offset_x,
                                     w.offset_x + w.width - 1, readout.width)};
    if (readout.strict && out_y)
        return {"height", fmt::format("rows {} to {} leave the sensor, which is {} px high", w.offset_y,
                                      w.offset_y + w.height - 1, readout.height)};
    if (w.offset_x >= readout.width || w.offset_y >= readout.height)
        return {w.offset_x >= readout.width ? "offset_x" : "offset_y",
                fmt::format("nothing of the window lies on the sensor, which has {} x {} px", readout.width,
                            readout.height)};
    for (const auto& [key, offset] : {std::pair{"offset_x", w.offset_x}, {"offset_y", w.offset_y}})
        if (readout.strict && offset % readout.window_step != 0)
            return {key, fmt::format("{} is not a multiple of {}, the step of this sensor's windows", offset,
                                     readout.window_step)};
    const Sampling sampling = w.sampling;
    if (sampling != Sampling::destructive && readout.shutter != Shutter::rolling)
        return {"sampling", fmt::format("\"{}\" needs a rolling shutter", name_of(sampling))};
    if (const SettingRange reads = reads_range(sampling); !reads.contains(w.reads))
        return {"reads", fmt::format("{} is out of range, allowed {} to {} with sampling \"{}\"", w.reads,
                                     reads.minimum, reads.maximum, name_of(sampling))};
    return {};
}

/// Number of windows in an image; each non-destructive read counts as one.
std::size_t delivered_windows(const std::vector<WindowSection>& windows) {
    std::size_t count = 0;
    for (const WindowSection& w : windows)
        count += w.sampling == Sampling::non_destructive ? static_cast<std::size_t>(w.reads) : std::size_t{1};
    return count;
}

void check_windows(const std::vector<WindowSection>& windows, const ReadoutSettings& readout,
                   const config::ReadTable& table) {
    const std::size_t most = std::min(static_cast<std::size_t>(readout.windows_max), max_windows);
    if (windows.size() > most) {
        table.refuse("window", fmt::format("{} windows, this sensor has at most {}", windows.size(), most));
        return;
    }
    const config::Member* list = table.table() == nullptr ? nullptr : table.table()->find("window");
    for (std::size_t i = 0; i < windows.size(); ++i) {
        const auto [key, reason] = explain_window(windows[i], readout);
        if (reason.empty()) continue;
        const config::Where where = table.where().in(fmt::format("window[{}]", i));
        config::Position at;
        if (list != nullptr) {
            const config::Value& window = list->value.items.at(i);
            const config::Member* member = window.find(key);
            at = member == nullptr ? window.at : member->value.at;
        }
        table.mistakes().add(where.in(key), at, reason);
    }
    if (const std::size_t delivered = delivered_windows(windows); delivered > max_windows)
        table.refuse("window",
                     fmt::format("{} windows with every non-destructive read counted, allowed are {}",
                                 delivered, max_windows));
}

} // namespace

void check_camera(const CameraSection& camera, const ReadoutSettings& readout,
                  const config::ReadTable& table) {
    const std::size_t before = table.mistakes().count();
    check_windows(camera.windows, readout, table);
    const std::int32_t width = camera.width == 0 ? readout.width - camera.offset_x : camera.width;
    const std::int32_t height = camera.height == 0 ? readout.height - camera.offset_y : camera.height;
    if (width < 1 || camera.offset_x > readout.width - width)
        table.refuse(camera.width == 0 ? "offset_x" : "width",
                     fmt::format("columns {} to {} leave the sensor, which is {} px wide", camera.offset_x,
                                 camera.offset_x + std::max(width, 1) - 1, readout.width));
    if (height < 1 || camera.offset_y > readout.height - height)
        table.refuse(camera.height == 0 ? "offset_y" : "height",
                     fmt::format("rows {} to {} leave the sensor, which is {} px high", camera.offset_y,
                                 camera.offset_y + std::max(height, 1) - 1, readout.height));
    if (!camera.windows.empty() || table.mistakes().count() != before) return;
    const WindowSection whole{width, height, camera.offset_x, camera.offset_y};
    if (const auto [key, reason] = explain_window(whole, readout); !reason.empty()) table.refuse(key, reason);
}

std::string_view key_of_feature(std::string_view feature, bool windows) {
    struct Row {
        std::string_view feature, key;
        bool of_window = false; ///< [[camera.window]] has the key, too
    };
    constexpr std::array rows{
        Row{"Width", "width", true},
        Row{"Height", "height", true},
        Row{"OffsetX", "offset_x", true},
        Row{"OffsetY", "offset_y", true},
        Row{"ExposureTime", "exposure_us", true},
        Row{"reads", "window", true},
        Row{"windows", "window", true},
        Row{"Gain", "gain_db"},
        Row{"AcquisitionFrameRate", "frame_rate_hz"},
        Row{"TriggerActivation", "trigger_activation"},
        Row{"ExposureMode", "exposure_mode"},
    };
    const auto* row =
        std::find_if(rows.begin(), rows.end(), [&](const Row& r) { return r.feature == feature; });
    if (row == rows.end()) return {};
    return windows && row->of_window ? "window" : row->key;
}

CameraSettings camera_settings(const CameraSection& camera, const SensorDescription& sensor) {
    const ReadoutSettings& readout = sensor.readout;
    CameraSettings settings;
    settings.region.x = camera.offset_x;
    settings.region.y = camera.offset_y;
    settings.region.width = camera.width == 0 ? readout.width - camera.offset_x : camera.width;
    settings.region.height = camera.height == 0 ? readout.height - camera.offset_y : camera.height;
    settings.pixel_format = camera.pixel_format;
    const auto from_us = [](double us) { return std::llround(us * static_cast<double>(ns_per_us)); };
    settings.exposure_ns = from_us(camera.exposure_us);
    if (!camera.windows.empty()) {
        std::vector<CameraWindow> windows;
        for (const WindowSection& w : camera.windows)
            windows.push_back(
                {{w.offset_x, w.offset_y, w.width, w.height}, from_us(w.exposure_us), w.sampling, w.reads});
        settings.set_windows(windows);
    }
    settings.gain_db = camera.gain_db;
    settings.frame_trigger.enabled = camera.trigger_mode;
    settings.frame_trigger.source = camera.trigger_source;
    settings.exposure_mode = camera.exposure_mode;
    settings.frame_rate_hz = camera.frame_rate_hz;
    settings.black_level_dn = sensor.detector.offset_dn;
    return settings;
}

} // namespace obscura::emulator
