// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/camera_features.hpp"

#include "config/document.hpp"
#include "core/camera/camera_names.hpp"
#include "core/camera/setting_ranges.hpp"
#include "service/call.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace obscura::emulator {
namespace {

using config::key;

double in_us(std::int64_t ns) {
    return static_cast<double>(ns) / static_cast<double>(ns_per_us);
}

std::int64_t from_us(double us) {
    return std::llround(us * static_cast<double>(ns_per_us));
}

} // namespace

CameraFeatures::CameraFeatures(const CameraSettings& settings)
    : settings_(settings),
      exposure_us_(in_us(settings.exposure_ns)),
      trigger_delay_us_(in_us(settings.trigger_delay_ns)) {}

config::Keys CameraFeatures::keys(const CameraLimits& limits) {
    CameraSettings& s = settings_;
    return {
        key("Width", &s.region.width)
            .unit("px")
            .range(limits.width_min, limits.sensor_width)
            .help("Width of the image; not during acquisition"),
        key("Height", &s.region.height)
            .unit("px")
            .range(limits.height_min, std::max(limits.sensor_height, limits.rows_max))
            .help("Height of the image; not during acquisition"),
        key("OffsetX", &s.region.x)
            .unit("px")
            .range(0, limits.sensor_width)
            .help("First column of the image on the sensor"),
        key("OffsetY", &s.region.y)
            .unit("px")
            .range(0, limits.sensor_height)
            .help("First row of the image on the sensor"),
        key("PixelFormat", &s.pixel_format)
            .help("Format in which GigE Vision sends the pixels; not during acquisition"),
        key("TestPattern", &s.test_pattern).help("Picture that the camera makes in place of the scene"),
        key("ExposureMode", &s.exposure_mode)
            .help("Timed: ExposureTime holds; TriggerWidth: the exposure lasts as long as the trigger pulse"),
        key("ExposureTime", &exposure_us_)
            .unit("us")
            .range(in_us(limits.exposure_min_ns), in_us(limits.exposure_max_ns))
            .help("Integration time of each row"),
        key("ExposureAuto", &s.exposure_auto)
            .help("Whether the camera adjusts ExposureTime to the brightness of its frames"),
        key("ExposureAutoTarget", &s.auto_target_percent)
            .unit("%")
            .range(auto_target_range_percent.minimum, auto_target_range_percent.maximum)
            .help("Level at which ExposureAuto aims: 0 is the black level, 100 full scale"),
        key("ExposureAutoPercentile", &s.auto_percentile)
            .unit("%")
            .range(auto_percentile_range.minimum, auto_percentile_range.maximum)
            .help("Share of the pixels that ExposureAuto brings to the target or below"),
        key("Gain", &s.gain_db)
            .unit("dB")
            .range(limits.gain_min_db, limits.gain_max_db)
            .help("Gain of the amplifier"),
        key("BlackLevel", &s.black_level_dn)
            .unit("DN")
            .range(limits.black_level_min_dn, limits.black_level_max_dn)
            .help("Digital number of a dark pixel"),
        key("AcquisitionMode", &s.acquisition_mode)
            .help("Frames of an acquisition: one, AcquisitionFrameCount or any number; not during "
                  "acquisition"),
        key("AcquisitionFrameCount", &s.acquisition_frame_count)
            .range(frame_count_range.minimum, frame_count_range.maximum)
            .help("Frames of an acquisition with MultiFrame; not during acquisition"),
        key("AcquisitionBurstFrameCount", &s.burst_frame_count)
            .range(frame_count_range.minimum, frame_count_range.maximum)
            .help("Frames of each trigger for FrameBurstStart; not during acquisition"),
        key("AcquisitionFrameRate", &s.frame_rate_hz)
            .unit("Hz")
            .range(limits.frame_rate_min_hz, limits.frame_rate_max_hz)
            .help("Frame rate of the free run, which is TriggerMode Off"),
        key("AcquisitionFrameRateEnable", &s.frame_rate_enabled)
            .help("Whether AcquisitionFrameRate holds; else the free run has the highest rate of the sensor"),
        key("TriggerMode", &s.frame_trigger.enabled, "On", "Off")
            .help("Whether a trigger starts each frame; Off: free run"),
        key("TriggerSource", &s.frame_trigger.source)
            .help("Source of the trigger; camera.trigger is Software, Line0 is driven by [trigger]"),
        key("TriggerActivation", &s.frame_trigger.activation).help("Edge or level of the line that triggers"),
        key("TriggerDelay", &trigger_delay_us_)
            .unit("us")
            .range(in_us(trigger_delay_range_ns.minimum), in_us(trigger_delay_range_ns.maximum))
            .help("Time from the trigger to the beginning of the frame"),
        key("TriggerDivider", &s.trigger_divider)
            .range(trigger_divider_range.minimum, trigger_divider_range.maximum)
            .help("Every n-th edge is a trigger"),
        key("TriggerOverlap", &s.trigger_overlap)
            .help("Whether a trigger is accepted while the frame before is read out"),
    };
}

CameraSettings CameraFeatures::settings() const {
    CameraSettings settings = settings_;
    settings.exposure_ns = from_us(exposure_us_);
    settings.trigger_delay_ns = from_us(trigger_delay_us_);
    return settings;
}

std::string_view category_of(std::string_view feature) {
    if (feature == "Gain" || feature == "BlackLevel") return "AnalogControl";
    for (const std::string_view start : {"Exposure", "Acquisition", "Trigger"})
        if (feature.starts_with(start)) return "AcquisitionControl";
    return "ImageFormatControl";
}

std::int64_t increment_of(std::string_view feature, const CameraLimits& limits) {
    if (feature == "Width" || feature == "OffsetX") return limits.width_step;
    if (feature == "Height" || feature == "OffsetY") return limits.height_step;
    return 0;
}

bool is_fixed_while_acquiring(std::string_view feature) {
    constexpr std::array<std::string_view, 6> fixed{"Width",
                                                    "Height",
                                                    "PixelFormat",
                                                    "AcquisitionMode",
                                                    "AcquisitionFrameCount",
                                                    "AcquisitionBurstFrameCount"};
    return std::find(fixed.begin(), fixed.end(), feature) != fixed.end();
}

nlohmann::json values_of(const config::Keys& keys) {
    std::string text;
    for (const config::Key& key : keys)
        text += fmt::format("{} = {}\n", key.name, config::value_text(key));
    return service::json_of(config::parse_text(text, "values"));
}

} // namespace obscura::emulator
