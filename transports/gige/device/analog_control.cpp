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
    of_setting({.name = "Gain",
                .address = 0xA160,
                .scale = 1000,
                .is_signed = true,
                .minimum = in_register(0xA164),
                .maximum = in_register(0xA168),
                .foreign = {.bound = true}}),
    Feature{.name = "BlackLevelSelector",
            .type = FeatureType::enumeration,
            .entries = black_level_selector_entries},
    of_setting({.name = "BlackLevel",
                .address = 0xA170,
                .selectors = {"BlackLevelSelector"},
                .scale = 1000,
                .is_signed = true,
                .minimum = in_register(0xA174),
                .maximum = in_register(0xA178),
                .foreign = {.bound = true}}),
};

} // namespace

FeatureCategory analog_control() {
    return {.name = "AnalogControl", .features = analog_features};
}

} // namespace obscura::transports::gige
