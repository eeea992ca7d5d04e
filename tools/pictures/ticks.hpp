// SPDX-License-Identifier: Apache-2.0
// Round numbers for axes and colour bars.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace obscura::tools {

/// Multiples of 1, 2 or 5 times a power of ten within [low, high], at most `most` of them and at least two if
/// most > 2.
[[nodiscard]] std::vector<double> round_ticks(double low, double high, int most);

/// Powers of ten within [low, high] (both positive), and 2 and 5 times these where there are fewer than
/// three.
[[nodiscard]] std::vector<double> decade_ticks(double low, double high);

/// Round numbers within [low, high] on a scale that is not linear: `position` maps to 0 .. 1, and no two
/// ticks are closer than `distance`. The roundest numbers are chosen first.
[[nodiscard]] std::vector<double>
spread_ticks(double low, double high, const std::function<double(double)>& position, double distance);

/// Labels with four significant digits, or more where labels would be equal otherwise and for whole numbers
/// below a million.
[[nodiscard]] std::vector<std::string> tick_labels(const std::vector<double>& ticks);

} // namespace obscura::tools
