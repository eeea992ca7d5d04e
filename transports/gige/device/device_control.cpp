// SPDX-License-Identifier: Apache-2.0
// DeviceControl: identity, link, temperature, time stamps.
#include "transports/gige/device/accessors.hpp"
#include "transports/gige/device/stream_channel.hpp"
#include "transports/gige/device/user_sets.hpp"

#include <algorithm>
#include <array>

namespace obscura::transports::gige {
namespace {

constexpr std::array device_type_entries{
    entry("Transmitter", 0),
};

constexpr std::array device_scan_type_entries{
    entry("Areascan", 0),
};

constexpr std::array device_tl_type_entries{
    entry("GigEVision", 0),
};

constexpr std::array device_temperature_selector_entries{
    entry("Sensor", 0),
};

constexpr std::array device_features{
    Feature{.name = "DeviceType",
            .type = FeatureType::enumeration,
            .visibility = Visibility::guru,
            .access = Access::read_only,
            .entries = device_type_entries},
    Feature{.name = "DeviceScanType",
            .type = FeatureType::enumeration,
            .access = Access::read_only,
            .entries = device_scan_type_entries},
    Feature{.name = "DeviceVendorName",
            .type = FeatureType::string,
            .access = Access::read_only,
            .address = reg::manufacturer,
            .bytes = 32,
            .foreign = {.bound = true}},
    Feature{.name = "DeviceModelName",
            .type = FeatureType::string,
            .access = Access::read_only,
            .address = reg::model,
            .bytes = 32,
            .foreign = {.bound = true}},
    Feature{.name = "DeviceManufacturerInfo",
            .type = FeatureType::string,
            .access = Access::read_only,
            .address = reg::manufacturer_info,
            .bytes = 48,
            .foreign = {.bound = true}},
    Feature{.name = "DeviceVersion",
            .type = FeatureType::string,
            .access = Access::read_only,
            .address = reg::device_version,
            .bytes = 32,
            .foreign = {.bound = true, .other_names = {"DeviceFirmwareVersion"}}},
    Feature{.name = "DeviceSerialNumber",
            .type = FeatureType::string,
            .access = Access::read_only,
            .address = reg::serial,
            .bytes = 16,
            .foreign = {.bound = true, .other_names = {"DeviceID"}}},
    Feature{.name = "DeviceUserID",
            .type = FeatureType::string,
            .address = reg::user_name,
            .bytes = 16,
            .foreign = {.bound = true}},
    Feature{.name = "DeviceSFNCVersionMajor", .access = Access::read_only, .constant = 2},
    Feature{.name = "DeviceSFNCVersionMinor", .access = Access::read_only, .constant = 7},
    Feature{.name = "DeviceSFNCVersionSubMinor", .access = Access::read_only},
    Feature{.name = "DeviceTLType",
            .type = FeatureType::enumeration,
            .access = Access::read_only,
            .entries = device_tl_type_entries},
    Feature{.name = "DeviceTLVersionMajor",
            .access = Access::read_only,
            .address = reg::version,
            .bootstrap_zero = true,
            .bits = {.lsb = 15, .msb = 0},
            .cached = true},
    Feature{.name = "DeviceTLVersionMinor",
            .access = Access::read_only,
            .address = reg::version,
            .bootstrap_zero = true,
            .bits = {.lsb = 31, .msb = 16},
            .cached = true},
    Feature{.name = "DeviceTLVersionSubMinor", .access = Access::read_only},
    Feature{.name = "DeviceLinkSpeed",
            .type = FeatureType::formula,
            .visibility = Visibility::expert,
            .unit = "Bps",
            .formula = "MBIT*125000",
            .variables = {{{"MBIT", "LinkSpeedReg"}}}},
    Feature{.name = "DeviceLinkThroughputLimitMode",
            .type = FeatureType::enumeration,
            .visibility = Visibility::expert,
            .address = 0xA208,
            .cached = true,
            .entries = off_on,
            .lock = FeatureLock::streaming,
            .reset =
                [](const DeviceContext& d) { return std::uint32_t{d.settings.throughput_limit_mbit_s > 0}; }},
    Feature{.name = "DeviceLinkThroughputLimit",
            .visibility = Visibility::expert,
            .address = 0xA204,
            .cached = true,
            .unit = "Bps",
            .minimum = fixed(1000000),
            .maximum = fixed(4000000000),
            .lock = FeatureLock::streaming,
            .reset =
                [](const DeviceContext& d) {
                    const double limit = d.settings.throughput_limit_mbit_s * 1e6 / 8;
                    return static_cast<std::uint32_t>(std::clamp(limit > 0 ? limit : 125e6, 1e6, 4e9));
                }},
    Feature{.name = "DeviceStreamChannelCount",
            .visibility = Visibility::expert,
            .access = Access::read_only,
            .address = reg::stream_channels,
            .cached = true},
    Feature{.name = "DeviceReset",
            .type = FeatureType::command,
            .visibility = Visibility::guru,
            .address = 0xA450,
            .run =
                [](DeviceContext& d, std::uint32_t) {
                    acquisition_stop(d);
                    return load_features(d, d.default_set);
                },
            .foreign = {.bound = true}},
    Feature{.name = "DeviceTemperatureSelector",
            .type = FeatureType::enumeration,
            .visibility = Visibility::expert,
            .entries = device_temperature_selector_entries},
    Feature{.name = "DeviceTemperature",
            .type = FeatureType::floating,
            .visibility = Visibility::expert,
            .tooltip = "Sensor temperature as configured",
            .access = Access::read_only,
            .address = 0xA180,
            .selectors = {"DeviceTemperatureSelector"},
            .unit = "C",
            .scale = 1000,
            .is_signed = true,
            .get = get_limit<&CameraLimits::temperature_c>,
            .foreign = {.bound = true}},
    Feature{.name = "TimestampLatch",
            .type = FeatureType::command,
            .visibility = Visibility::expert,
            .address = reg::timestamp_control,
            .command_value = 2},
    Feature{.name = "TimestampReset",
            .type = FeatureType::command,
            .visibility = Visibility::expert,
            .address = reg::timestamp_control,
            .lock = FeatureLock::streaming},
    Feature{.name = "TimestampLatchValue",
            .visibility = Visibility::expert,
            .tooltip = "Device time at the last latch: TAI, or since the last reset",
            .access = Access::read_only,
            .address = reg::timestamp_high,
            .bytes = 8,
            .unit = "ns"},
    Feature{.name = "LinkSpeedReg",
            .listed = false,
            .access = Access::read_only,
            .address = reg::link_speed,
            .cached = true},
};

} // namespace

FeatureCategory device_control() {
    return {.name = "DeviceControl", .features = device_features};
}

} // namespace obscura::transports::gige
