// SPDX-License-Identifier: Apache-2.0
#include "core/text/length_unit.hpp"

#include "core/text/text.hpp"

#include <string>
#include <tuple>

namespace obscura {

std::optional<double> metres_of_unit(std::string_view name) {
    std::string unit = lower_case(name);
    if (unit == "foot" || unit == "feet" || unit == "ft") return 0.3048;
    for (const std::string_view metre : {"metres", "meters", "metre", "meter"})
        if (unit.ends_with(metre)) {
            unit.resize(unit.size() - metre.size());
            break;
        }
    for (const auto& [prefix, symbol, metres] :
         {std::tuple{"", "m", 1.0}, {"kilo", "km", 1000.0}, {"centi", "cm", 0.01}, {"milli", "mm", 0.001}})
        if (unit == symbol || (unit == prefix && unit.size() < name.size())) return metres;
    return std::nullopt;
}

} // namespace obscura
