// SPDX-License-Identifier: Apache-2.0
// Table of the camera settings: SFNC name, category, member, unit, range, lock and help of each.
#pragma once

#include "core/camera/camera.hpp"
#include "core/camera/camera_names.hpp"
#include "core/camera/setting.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string_view>

namespace obscura {

/// Largest width or height of a sensor, and resolutions of its ADC.
constexpr std::int32_t max_sensor_extent = 65536;
constexpr int min_adc_bits = 8, max_adc_bits = 16;
/// Largest black level that an ADC of `bits` bits allows: half of its range.
constexpr double max_black_level_dn(int bits) {
    return static_cast<double>(std::uint32_t{1} << (bits - 1));
}

/// Settings that every camera has, in the order in which clients list them. A trigger is that of FrameStart,
/// a window the first one.
inline constexpr auto camera_settings_table = [] {
    using S = CameraSettings;
    using L = CameraLimits;
    using setting_detail::limits_in;
    using setting_detail::member;
    using setting_detail::offsets_in;
    constexpr SettingRange frame_counts{1, std::numeric_limits<std::uint32_t>::max()};
    return std::array{
        Setting{.name = "Width",
                .category = "ImageFormatControl",
                .member = member<&S::region, &Region::width>(),
                .unit = "px",
                .range_in = limits_in<&L::width_min, &L::sensor_width>,
                .increment = &L::width_step,
                .lock = SettingLock::streaming,
                .per_window = true,
                .help = "Width of the image or window"},
        Setting{.name = "Height",
                .category = "ImageFormatControl",
                .member = member<&S::region, &Region::height>(),
                .unit = "px",
                .range_in = limits_in<&L::height_min, &L::sensor_height>,
                .increment = &L::height_step,
                .lock = SettingLock::streaming,
                .per_window = true,
                .help = "Height of the image or window; push-broom sensors: number of lines"},
        Setting{.name = "OffsetX",
                .category = "ImageFormatControl",
                .member = member<&S::region, &Region::x>(),
                .unit = "px",
                .range_in = offsets_in<&L::sensor_width>,
                .increment = &L::width_step,
                .per_window = true,
                .help = "First column of the image or window on the sensor"},
        Setting{.name = "OffsetY",
                .category = "ImageFormatControl",
                .member = member<&S::region, &Region::y>(),
                .unit = "px",
                .range_in = offsets_in<&L::sensor_height>,
                .increment = &L::height_step,
                .per_window = true,
                .help = "First row of the image or window on the sensor"},
        Setting{.name = "PixelFormat",
                .category = "ImageFormatControl",
                .member = member<&S::pixel_format>(),
                .lock = SettingLock::streaming,
                .help = "Format in which GigE Vision sends the pixels"},
        Setting{.name = "TestPattern",
                .category = "ImageFormatControl",
                .member = member<&S::test_pattern>(),
                .help = "Picture that the camera makes in place of the scene"},
        Setting{
            .name = "ExposureMode",
            .category = "AcquisitionControl",
            .member = member<&S::exposure_mode>(),
            .help =
                "Timed: ExposureTime applies; "
                "TriggerWidth: the exposure lasts as long as the trigger pulse, if a line that reports both edges begins it"},
        Setting{.name = "ExposureTime",
                .category = "AcquisitionControl",
                .member = member<&S::exposure_ns>(),
                .unit = "us",
                .range_in = limits_in<&L::exposure_min_ns, &L::exposure_max_ns>,
                .per_window = true,
                .help = "Integration time of each row"},
        Setting{
            .name = "ExposureAuto",
            .category = "AcquisitionControl",
            .member = member<&S::exposure_auto>(),
            .help =
                "Whether the camera adjusts ExposureTime after each frame to bring ExposureAutoPercentile of the first window to ExposureAutoTarget"},
        Setting{.name = "ExposureAutoTarget",
                .category = "AcquisitionControl",
                .member = member<&S::auto_target_percent>(),
                .unit = "%",
                .range = SettingRange{1, 99},
                .help = "Level at which ExposureAuto aims: 0 is the black level, 100 full scale"},
        Setting{
            .name = "ExposureAutoPercentile",
            .category = "AcquisitionControl",
            .member = member<&S::auto_percentile>(),
            .unit = "%",
            .range = SettingRange{1, 100},
            .help =
                "Share of the pixels of the first window that ExposureAuto brings to the target or below"},
        Setting{.name = "Gain",
                .category = "AnalogControl",
                .member = member<&S::gain_db>(),
                .unit = "dB",
                .range_in = limits_in<&L::gain_min_db, &L::gain_max_db>,
                .help = "Gain of the amplifier"},
        Setting{.name = "BlackLevel",
                .category = "AnalogControl",
                .member = member<&S::black_level_dn>(),
                .unit = "DN",
                .range_in = limits_in<&L::black_level_min_dn, &L::black_level_max_dn>,
                .help = "Digital number of a dark pixel"},
        Setting{.name = "AcquisitionMode",
                .category = "AcquisitionControl",
                .member = member<&S::acquisition_mode>(),
                .lock = SettingLock::streaming,
                .help = "Frames of an acquisition: one, AcquisitionFrameCount or any number"},
        Setting{.name = "AcquisitionFrameCount",
                .category = "AcquisitionControl",
                .member = member<&S::acquisition_frame_count>(),
                .range = frame_counts,
                .lock = SettingLock::streaming,
                .help = "Frames of an acquisition with MultiFrame"},
        Setting{.name = "AcquisitionBurstFrameCount",
                .category = "AcquisitionControl",
                .member = member<&S::burst_frame_count>(),
                .range = frame_counts,
                .lock = SettingLock::streaming,
                .help = "Frames of each trigger for FrameBurstStart"},
        Setting{.name = "AcquisitionFrameRate",
                .category = "AcquisitionControl",
                .member = member<&S::frame_rate_hz>(),
                .unit = "Hz",
                .range_in = limits_in<&L::frame_rate_min_hz, &L::frame_rate_max_hz>,
                .help =
                    "Frame rate of the free run, which is TriggerMode Off, and while a level trigger holds"},
        Setting{
            .name = "AcquisitionFrameRateEnable",
            .category = "AcquisitionControl",
            .member = member<&S::frame_rate_enabled>(),
            .help =
                "Whether AcquisitionFrameRate holds; else the free run has the highest rate of the sensor"},
        Setting{.name = "TriggerMode",
                .category = "AcquisitionControl",
                .member = setting_detail::on_off_member<&S::frame_trigger, &TriggerChoice::enabled>(),
                .help = "Whether the trigger is awaited; FrameStart Off: free run"},
        Setting{.name = "TriggerSource",
                .category = "AcquisitionControl",
                .member = member<&S::frame_trigger, &TriggerChoice::source>(),
                .help = "Source of the trigger; Software: a command; "
                        "Line0: what [trigger] of the configuration assigns to it, Line1: [trigger.line1]"},
        Setting{.name = "TriggerActivation",
                .category = "AcquisitionControl",
                .member = member<&S::frame_trigger, &TriggerChoice::activation>(),
                .help = "Edge or level of the line that triggers, of those that its source reports; "
                        "while a level holds, frames follow each other at AcquisitionFrameRate"},
        Setting{.name = "TriggerDelay",
                .category = "AcquisitionControl",
                .member = member<&S::trigger_delay_ns>(),
                .unit = "us",
                .range = SettingRange{0, 1e7},
                .help = "Time from the trigger to the beginning of the frame"},
        Setting{.name = "TriggerDivider",
                .category = "AcquisitionControl",
                .member = member<&S::trigger_divider>(),
                .range = SettingRange{1, 1'000'000},
                .help = "Every n-th edge is a trigger"},
        Setting{.name = "TriggerOverlap",
                .category = "AcquisitionControl",
                .member = member<&S::trigger_overlap>(),
                .help = "Whether a trigger is accepted while the frame before is read out"},
    };
}();

/// Settings of a window that only some sensors can have.
inline constexpr auto window_settings_table = [] {
    using S = CameraSettings;
    using setting_detail::member;
    return std::array{
        Setting{.name = "RegionSampling",
                .category = "ImageFormatControl",
                .member = member<&S::sampling>(),
                .lock = SettingLock::streaming,
                .per_window = true,
                .help = "How the window is read. destructive: one sample and reset; "
                        "non-destructive: each of several reads without reset is delivered; "
                        "cds (CorrelatedDouble): last read minus first; ramp: line fitted through all reads"},
        Setting{.name = "RegionReads",
                .category = "ImageFormatControl",
                .member = member<&S::reads>(),
                .range = SettingRange{1, 64},
                .lock = SettingLock::streaming,
                .per_window = true,
                .help = "Number of reads of a window that is not read destructively"},
    };
}();

/// The row of `name` in both tables; null if there is none.
[[nodiscard]] constexpr const Setting* find_setting(std::string_view name) {
    for (const std::span<const Setting> table :
         {std::span<const Setting>(camera_settings_table), std::span<const Setting>(window_settings_table)})
        for (const Setting& setting : table)
            if (setting.name == name) return &setting;
    return nullptr;
}
/// The row of a name that is known to be there: does not compile if it is not.
[[nodiscard]] consteval const Setting& setting(std::string_view name) {
    return *find_setting(name);
}

/// Limits that are as wide as those of any camera may be.
[[nodiscard]] CameraLimits widest_limits();
/// Range of a setting over all cameras; none for one that is no number.
[[nodiscard]] std::optional<SettingRange> widest_range(const Setting& setting);
/// The value that a setting has when nothing else is configured.
[[nodiscard]] double default_of(const Setting& setting);
/// Help that names the lock as well, for readers who are not shown it otherwise. Static storage.
[[nodiscard]] std::string_view help_with_lock(const Setting& setting);

/// CameraWindow::reads. A destructive read is the only one of its exposure; a difference needs two.
[[nodiscard]] constexpr SettingRange reads_range(Sampling sampling) {
    const SettingRange any = *setting("RegionReads").range;
    switch (sampling) {
    case Sampling::destructive:
        return {1, 1};
    case Sampling::non_destructive:
        return any;
    case Sampling::cds:
    case Sampling::ramp:
        break;
    }
    return {2, any.maximum};
}

} // namespace obscura
