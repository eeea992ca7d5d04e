// SPDX-License-Identifier: Apache-2.0
// UserSetControl.
#include "transports/gige/device/accessors.hpp"
#include "transports/gige/device/user_sets.hpp"

#include <array>

namespace obscura::transports::gige {
namespace {

constexpr std::uint32_t set_default = 0; ///< of UserSetSelector

Status save_user_set(DeviceContext& d, std::uint32_t) {
    if (stored(d, "UserSetSelector") == set_default) return Status::write_protect;
    d.user_set_1 = saved_features(d);
    return write_state_file(d) ? Status::success : Status::error;
}

constexpr std::array user_sets{
    entry("Default", 0),
    entry("UserSet1", 1),
};

constexpr std::array user_set_features{
    Feature{.name = "UserSetSelector",
            .type = FeatureType::enumeration,
            .address = 0xA460,
            .entries = user_sets,
            .in_user_set = false},
    Feature{.name = "UserSetLoad",
            .type = FeatureType::command,
            .address = 0xA464,
            .selectors = {"UserSetSelector"},
            .run =
                [](DeviceContext& d, std::uint32_t) {
                    return load_features(d, stored(d, "UserSetSelector") == set_default ? d.default_set
                                                                                        : d.user_set_1);
                }},
    Feature{.name = "UserSetSave",
            .type = FeatureType::command,
            .address = 0xA468,
            .selectors = {"UserSetSelector"},
            .run = save_user_set},
    Feature{.name = "UserSetDefault",
            .type = FeatureType::enumeration,
            .address = 0xA46C,
            .entries = user_sets,
            .in_user_set = false,
            .written = [](DeviceContext& d, std::uint32_t) { d.state_changed = true; }},
};

} // namespace

FeatureCategory user_set_control() {
    return {.name = "UserSetControl", .features = user_set_features};
}

} // namespace obscura::transports::gige
