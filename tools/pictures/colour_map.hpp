// SPDX-License-Identifier: Apache-2.0
// False colours: maps from 0 .. 1 to RGB.
#pragma once

#include <array>
#include <cstdint>

namespace obscura::tools {

using Rgb = std::array<std::uint8_t, 3>;

enum class ColourMap : std::uint8_t {
    grey,
    viridis,   ///< perceptually uniform (van der Walt and Smith 2015, CC0)
    diverging, ///< blue, white, red (Moreland 2009) for differences around zero
    cyclic,    ///< for angles: both ends are the same
};

/// Colour at `level`, which is clamped to 0 .. 1.
[[nodiscard]] Rgb colour(ColourMap map, double level);

/// Colour of the class `number`, from 0, in a qualitative palette that repeats after 10.
[[nodiscard]] Rgb class_colour(std::int64_t number);

constexpr Rgb black{0, 0, 0}, white{255, 255, 255};
/// Pixels without a value.
constexpr Rgb no_value_colour{40, 40, 40};

} // namespace obscura::tools
