// SPDX-License-Identifier: Apache-2.0
// Profiles of fixed patterns after EMVA 1288: mean, least and largest value of each column or row.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace obscura::tools {

enum class Along : std::uint8_t {
    rows,    ///< horizontal: one value for each column
    columns, ///< vertical: one value for each row
};

/// Values of a profile, by column or row.
struct Profile {
    std::vector<double> mean, min, max;
    std::vector<double> middle; ///< the values of the middle row or column itself
};

/// Profile of `values` (row-major, `width` columns): over the rows at each column (Along::rows), or over the
/// columns at each row.
[[nodiscard]] Profile profile(const std::vector<double>& values, std::size_t width, Along along);

} // namespace obscura::tools
