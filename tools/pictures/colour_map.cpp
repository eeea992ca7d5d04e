// SPDX-License-Identifier: Apache-2.0
#include "tools/pictures/colour_map.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace obscura::tools {
namespace {

constexpr Rgb greys[] = {{0, 0, 0}, {255, 255, 255}};
constexpr Rgb viridis[] = {{68, 1, 84},    {72, 40, 120},  {62, 73, 137},  {49, 104, 142}, {38, 130, 142},
                           {31, 158, 137}, {53, 183, 121}, {110, 206, 88}, {181, 222, 43}, {253, 231, 37}};
constexpr Rgb diverging[] = {{59, 76, 192},   {98, 130, 234},  {141, 176, 254},
                             {184, 208, 249}, {221, 221, 221}, {245, 196, 173},
                             {244, 154, 123}, {222, 96, 77},   {180, 4, 38}};
constexpr Rgb cyclic[] = {{47, 20, 54},    {89, 85, 172}, {117, 167, 198}, {226, 217, 226},
                          {206, 144, 109}, {150, 63, 75}, {47, 20, 54}};
// Okabe and Ito (2008), distinguishable with colour vision deficiency, and three more.
constexpr Rgb classes[] = {{230, 159, 0}, {86, 180, 233},  {0, 158, 115},   {240, 228, 66}, {0, 114, 178},
                           {213, 94, 0},  {204, 121, 167}, {153, 153, 153}, {136, 34, 85},  {170, 210, 160}};

std::span<const Rgb> anchors(ColourMap map) {
    switch (map) {
    case ColourMap::viridis:
        return viridis;
    case ColourMap::diverging:
        return diverging;
    case ColourMap::cyclic:
        return cyclic;
    case ColourMap::grey:
        break;
    }
    return greys;
}

} // namespace

Rgb colour(ColourMap map, double level) {
    const std::span<const Rgb> table = anchors(map);
    const double at = std::clamp(level, 0.0, 1.0) * static_cast<double>(table.size() - 1);
    const auto below = std::min(static_cast<std::size_t>(at), table.size() - 2);
    const double part = at - static_cast<double>(below);
    Rgb out;
    for (std::size_t k = 0; k < out.size(); ++k)
        out[k] = static_cast<std::uint8_t>(std::lround(
            std::lerp(static_cast<double>(table[below][k]), static_cast<double>(table[below + 1][k]), part)));
    return out;
}

Rgb class_colour(std::int64_t number) {
    constexpr auto count = static_cast<std::int64_t>(std::size(classes));
    return classes[static_cast<std::size_t>((number % count + count) % count)];
}

} // namespace obscura::tools
