// SPDX-License-Identifier: Apache-2.0
// ActionControl. The registers are bootstrap registers.
#include "transports/gige/device/accessors.hpp"

#include <array>

namespace obscura::transports::gige {
namespace {

constexpr std::array action_features{
    Feature{.name = "ActionDeviceKey", .address = reg::action_device_key, .cached = true},
    Feature{.name = "ActionSelector", .minimum = fixed(1), .maximum = fixed(1), .constant = 1},
    Feature{.name = "ActionGroupKey",
            .address = reg::action_groups,
            .cached = true,
            .selectors = {"ActionSelector"}},
    Feature{.name = "ActionGroupMask",
            .address = reg::action_groups + 4,
            .cached = true,
            .selectors = {"ActionSelector"}},
};

} // namespace

FeatureCategory action_control() {
    return {.name = "ActionControl", .features = action_features};
}

} // namespace obscura::transports::gige
