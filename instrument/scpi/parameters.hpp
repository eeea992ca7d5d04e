// SPDX-License-Identifier: Apache-2.0
// Values of SCPI data elements: integers, units, settings of a camera.
#pragma once

#include "instrument/link/camera_link.hpp"
#include "instrument/scpi/message.hpp"

#include <cstdint>
#include <string>
#include <string_view>

namespace obscura::instrument {

/// A whole number from 0 to `most`. Throws ScpiError.
[[nodiscard]] std::uint32_t integer_of(const Parameter& parameter, std::uint32_t most);
/// The text of a string. Throws ScpiError.
[[nodiscard]] const std::string& string_of(const Parameter& parameter);

/// How the numbers of a command without suffix are meant.
enum class PlainNumbers : std::uint8_t {
    feature_unit, ///< in the unit of the feature, as SFNC has it
    base_unit,    ///< in the SI unit, as SCPI has it
};

/// SI unit of a quantity and how many of the feature's unit make one: 1e6 for us.
struct BaseUnit {
    std::string_view name;
    double per_unit;
};
/// A unit that SCPI has no suffix for is its own base unit.
[[nodiscard]] BaseUnit base_unit_of(std::string_view unit);

/// The value of `parameter` for a feature, MINimum and MAXimum included. Throws ScpiError.
[[nodiscard]] FeatureValue value_for(const Feature& feature, const Parameter& parameter,
                                     PlainNumbers numbers);
/// The feature's own value, or a limit for MINimum and MAXimum. Throws ScpiError.
[[nodiscard]] FeatureValue limit_of(const Feature& feature, const Parameter& parameter);
/// The value as a response: in the feature's unit with strings in quotes, or in the SI unit with bare words.
[[nodiscard]] std::string response_of(const Feature& feature, const FeatureValue& value,
                                      PlainNumbers numbers);

} // namespace obscura::instrument
