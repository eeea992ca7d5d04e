// SPDX-License-Identifier: Apache-2.0
#include "emulator/config/camera_section.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace obscura::emulator {
namespace {

using config::key;

/// `text` for a key, which does not copy it: lives as long as the program. Thread-safe.
std::string_view lasting(std::string text) {
    static std::mutex mutex;
    static std::set<std::string, std::less<>> texts;
    const std::lock_guard lock(mutex);
    return *texts.insert(std::move(text)).first;
}

/// `key` with unit, range and help of the setting table. `note` is what this file alone has to say.
config::Key of_setting(config::Key key, const Setting& setting, std::string_view before = {},
                       std::string_view note = {}) {
    const std::string_view separator = note.empty() ? "" : "; ";
    key = std::move(key)
              .unit(setting.unit)
              .help(lasting(fmt::format("{}{}{}{}", before, setting.help, separator, note)));
    if (const std::optional<SettingRange> range = widest_range(setting))
        key = std::move(key).range(range->minimum, range->maximum);
    return key;
}

config::Section window_section(WindowSection& s) {
    config::Section section;
    section.help = "One of several windows that are read in one frame, in their order.";
    section.keys = {
        of_setting(key("width", &s.width).required(), setting("Width")),
        of_setting(key("height", &s.height).required(), setting("Height")),
        of_setting(key("offset_x", &s.offset_x), setting("OffsetX")),
        of_setting(key("offset_y", &s.offset_y), setting("OffsetY")),
        of_setting(key("exposure_us", &s.exposure_us), setting("ExposureTime"), {},
                   "that of [camera] if not given"),
        of_setting(key("sampling", &s.sampling), setting("RegionSampling")),
        of_setting(key("reads", &s.reads), setting("RegionReads")),
    };
    return section;
}

/// A key of [camera] and the setting whose value after reset it is.
struct SettingKey {
    const Setting& setting;
    config::Key key;
};

std::vector<SettingKey> setting_keys(CameraSection& s) {
    const auto row = [](const Setting& setting, config::Key key, std::string_view note = {},
                        std::string_view of = {}) {
        const std::string before = fmt::format("{}{} after reset. ", setting.name, of);
        return SettingKey{setting, of_setting(std::move(key), setting, before, note)};
    };
    /// A setting of the trigger that starts frames.
    const auto trigger = [&](const Setting& setting, config::Key key, std::string_view note = {}) {
        return row(setting, std::move(key), note, " of FrameStart");
    };
    /// An extent, which may be left to the sensor.
    const auto extent = [&](const Setting& setting, config::Key key) {
        SettingKey made = row(setting, std::move(key), "0: the whole sensor");
        made.key = std::move(made.key).range(0, made.key.range().max);
        return made;
    };
    CameraSettings& c = s.settings;
    return {
        extent(setting("Width"), key("width", &c.region.width)),
        extent(setting("Height"), key("height", &c.region.height)),
        row(setting("OffsetX"), key("offset_x", &c.region.x)),
        row(setting("OffsetY"), key("offset_y", &c.region.y)),
        row(setting("PixelFormat"), key("pixel_format", &c.pixel_format)),
        row(setting("ExposureTime"), key("exposure_us", &s.exposure_us)),
        row(setting("Gain"), key("gain_db", &c.gain_db)),
        trigger(setting("TriggerMode"), key("trigger_mode", &c.frame_trigger.enabled, "On", "Off")),
        trigger(setting("TriggerSource"),
                key("trigger_source", &c.frame_trigger.source)
                    .choices({"Line0", "Line1", "Line2", "Line3", "Software", "Action1"})),
        trigger(setting("TriggerActivation"), key("trigger_activation", &s.trigger_activation, "auto"),
                "auto: all edges that the line's source reports"),
        row(setting("ExposureMode"), key("exposure_mode", &c.exposure_mode)),
        row(setting("AcquisitionFrameRate"), key("frame_rate_hz", &c.frame_rate_hz)),
    };
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
    config::Section section;
    section.name = "camera";
    section.help =
        "Values that the features of the camera have after reset; clients change them over GigE Vision.";
    for (SettingKey& row : setting_keys(s)) {
        const bool in_windows = !s.windows.empty() && row.setting.category == "ImageFormatControl" &&
                                row.setting.per_window; // the windows have the extents
        section.keys.push_back(in_windows ? std::move(row.key).unprinted() : std::move(row.key));
    }
    for (
        config::Key& own : config::Keys{
            key("readout_timing", &s.readout_timing)
                .help("Release of rows to the transports. sensor: when the chip reads them; "
                      "fast: as soon as they are rendered; "
                      "triggers and exposures are those of the chip in both cases"),
            key("rows_max", &s.rows_max)
                .unit("px")
                .range(0, 1048576)
                .help(
                    "Largest number of rows of a composed image that a client may request; 0: as many as sensor and windows need"),
        })
        section.keys.push_back(std::move(own));
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

/// Region of [camera]: extents that are not given reach to the end of the sensor.
Region region_of(const CameraSection& camera, const ReadoutSettings& readout) {
    Region region = camera.settings.region;
    if (region.width == 0) region.width = readout.width - region.x;
    if (region.height == 0) region.height = readout.height - region.y;
    return region;
}

} // namespace

void check_camera(const CameraSection& camera, const ReadoutSettings& readout,
                  const config::ReadTable& table) {
    const std::size_t before = table.mistakes().count();
    check_windows(camera.windows, readout, table);
    const auto [x, y, width, height] = region_of(camera, readout);
    const bool given_width = camera.settings.region.width != 0;
    const bool given_height = camera.settings.region.height != 0;
    if (width < 1 || x > readout.width - width)
        table.refuse(given_width ? "width" : "offset_x",
                     fmt::format("columns {} to {} leave the sensor, which is {} px wide", x,
                                 x + std::max(width, 1) - 1, readout.width));
    if (height < 1 || y > readout.height - height)
        table.refuse(given_height ? "height" : "offset_y",
                     fmt::format("rows {} to {} leave the sensor, which is {} px high", y,
                                 y + std::max(height, 1) - 1, readout.height));
    if (!camera.windows.empty() || table.mistakes().count() != before) return;
    const WindowSection whole{width, height, x, y};
    if (const auto [key, reason] = explain_window(whole, readout); !reason.empty()) table.refuse(key, reason);
}

std::string_view key_of_feature(std::string_view feature, bool windows) {
    if (feature == "reads" || feature == "windows") return "window";
    CameraSection any;
    for (const SettingKey& row : setting_keys(any))
        if (row.setting.name == feature) return windows && row.setting.per_window ? "window" : row.key.name;
    return {};
}

CameraSettings camera_settings(const CameraSection& camera, const SensorDescription& sensor) {
    CameraSettings settings = camera.settings;
    settings.region = region_of(camera, sensor.readout);
    const auto from_us = [](double us) { return std::llround(us * static_cast<double>(ns_per_us)); };
    settings.exposure_ns = from_us(camera.exposure_us);
    if (!camera.windows.empty()) {
        std::vector<CameraWindow> windows;
        for (const WindowSection& w : camera.windows)
            windows.push_back(
                {{w.offset_x, w.offset_y, w.width, w.height}, from_us(w.exposure_us), w.sampling, w.reads});
        settings.set_windows(windows);
    }
    settings.black_level_dn = sensor.detector.offset_dn;
    return settings;
}

} // namespace obscura::emulator
