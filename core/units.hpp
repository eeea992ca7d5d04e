// SPDX-License-Identifier: Apache-2.0
// Angles in radians: degree, milliarcsecond.
#pragma once

#include <numbers>

namespace obscura {

inline constexpr double degree = std::numbers::pi / 180;
/// Unit of parallaxes and proper motions in star catalogues.
inline constexpr double milliarcsecond = std::numbers::pi / (180 * 3600e3);

} // namespace obscura
