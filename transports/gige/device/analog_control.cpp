// SPDX-License-Identifier: Apache-2.0
// AnalogControl: gain and black level.
#include "transports/gige/device/accessors.hpp"

#include <array>

namespace obscura::transports::gige {
namespace {

constexpr std::array black_level_selector_entries{
    entry("All", 0),
};

constexpr std::array analog_features{
    Feature{.name = "Gain",
            .type = FeatureType::floating,
            .address = 0xA160,
            .unit = "dB",
            .scale = 1000,
            .is_signed = true,
            .minimum = in_register(0xA164, get_limit<&CameraLimits::gain_min_db>),
            .maximum = in_register(0xA168, get_limit<&CameraLimits::gain_max_db>),
            .get = get_setting<&CameraSettings::gain_db>,
            .set = set_setting<&CameraSettings::gain_db>,
            .foreign = {.bound = true}},
    Feature{.name = "BlackLevelSelector",
            .type = FeatureType::enumeration,
            .entries = black_level_selector_entries},
    Feature{.name = "BlackLevel",
            .type = FeatureType::floating,
            .address = 0xA170,
            .selectors = {"BlackLevelSelector"},
            .unit = "DN",
            .scale = 1000,
            .is_signed = true,
            .minimum = in_register(0xA174, get_limit<&CameraLimits::black_level_min_dn>),
            .maximum = in_register(0xA178, get_limit<&CameraLimits::black_level_max_dn>),
            .get = get_setting<&CameraSettings::black_level_dn>,
            .set = set_setting<&CameraSettings::black_level_dn>,
            .foreign = {.bound = true}},
};

} // namespace

FeatureCategory analog_control() {
    return {.name = "AnalogControl", .features = analog_features};
}

} // namespace obscura::transports::gige
