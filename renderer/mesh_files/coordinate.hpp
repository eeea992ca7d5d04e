// SPDX-License-Identifier: Apache-2.0
// Coordinates of vertices in text files of meshes.
#pragma once

#include "core/text/number.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <string>
#include <string_view>

namespace obscura::renderer {

/// Reads `word`, in units of the file, into `metres`. Returns an empty string, or why it is no coordinate.
inline std::string read_coordinate(std::string_view word, double metres_per_unit, float& metres) {
    const std::optional<double> number = decimal_number(word);
    if (!number && !is_number_not_finite(word))
        return fmt::format("'{}' is not a coordinate: a decimal number is wanted", word);
    if (number) metres = static_cast<float>(*number * metres_per_unit);
    if (!number || !std::isfinite(metres))
        return fmt::format("coordinate '{}' is not finite: allowed are numbers up to 3.4e38 m", word);
    return {};
}

} // namespace obscura::renderer
