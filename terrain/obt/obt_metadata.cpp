// SPDX-License-Identifier: Apache-2.0
#include "terrain/obt/obt_metadata.hpp"

#include "core/error.hpp"
#include "terrain/obt/obt_layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string_view>

namespace obscura::terrain {
namespace {

/// Steps of lattices: about a micrometre to a kilometre.
constexpr int min_exponent = -20, max_exponent = 10;
constexpr double max_magnitude = 1e30;

bool has_control(std::string_view text) {
    return std::any_of(text.begin(), text.end(),
                       [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; });
}

} // namespace

std::string uuid_text(const ObtUuid& uuid) {
    std::string text;
    for (std::size_t i = 0; i < uuid.size(); ++i)
        text += fmt::format("{}{:02x}", i == 4 || i == 6 || i == 8 || i == 10 ? "-" : "", uuid[i]);
    return text;
}

void validate(const ObtMetadata& m, const std::string& name) {
    const auto refuse = [&](const std::string& why) { throw InputError(name + ": " + why); };
    if (!(m.width > 0 && m.height > 0 && m.width <= max_obt_samples && m.height <= max_obt_samples))
        refuse(fmt::format("{} x {} samples: allowed are 1 to 2^40 each", m.width, m.height));
    if (m.planes < 1 || m.planes > max_obt_planes)
        refuse(fmt::format("{} planes: allowed are 1 to {}", m.planes, max_obt_planes));
    if (m.rgb && m.planes != 3)
        refuse(fmt::format("red, green and blue in {} planes: allowed are 3", m.planes));
    if (m.kind == ObtKind::heights && m.planes != 1)
        refuse(fmt::format("heights in {} planes: allowed is 1", m.planes));
    if (m.lattice && m.type != SampleType::u16)
        refuse(fmt::format("a lattice of {}: allowed is u16", name_of(m.type)));
    if (!(m.finest_exponent >= min_exponent && m.finest_exponent <= m.coarsest_exponent &&
          m.coarsest_exponent <= max_exponent))
        refuse(fmt::format("steps from 2^{} to 2^{}: allowed are ascending exponents from {} to {}",
                           m.finest_exponent, m.coarsest_exponent, min_exponent, max_exponent));
    if (!(std::isfinite(m.scale) && m.scale != 0 && std::abs(m.scale) <= max_magnitude) ||
        !(std::abs(m.offset) <= max_magnitude))
        refuse(fmt::format("scale {} and offset {}: allowed are finite numbers, scale not 0", m.scale,
                           m.offset));
    if (m.nodata) {
        const auto [least, most] = m.type == SampleType::u8    ? std::pair{0, 255}
                                   : m.type == SampleType::i16 ? std::pair{-32768, 32767}
                                                               : std::pair{0, 65535};
        if (m.lattice || m.type == SampleType::f16 || m.type == SampleType::f32)
            refuse("a number for missing samples: allowed with u8, i16 and u16 without lattice only");
        if (*m.nodata < least || *m.nodata > most)
            refuse(
                fmt::format("number {} for missing samples: allowed are {} to {}", *m.nodata, least, most));
    }
    const auto axis = [](double a) { return a >= 0 && a <= 1e12; };
    if (!axis(m.semi_axes_m.x) || !axis(m.semi_axes_m.y) || !axis(m.semi_axes_m.z))
        refuse(fmt::format("semi-axes {}, {}, {} m: allowed are 0 to 1e12", m.semi_axes_m.x, m.semi_axes_m.y,
                           m.semi_axes_m.z));
    const auto text = [&](const std::string& value, std::size_t most, std::string_view what) {
        if (value.size() > most || has_control(value))
            refuse(fmt::format("{}: allowed are at most {} bytes without control characters", what, most));
    };
    text(m.unit, 31, "unit");
    text(m.title, 127, "title");
    text(m.licence, 127, "licence");
    text(m.source, 511, "source");
    for (const ObtPlaneStatistics& s : m.statistics)
        if (!(std::isfinite(s.least) && std::isfinite(s.largest) && std::isfinite(s.mean) &&
              s.least <= s.largest))
            refuse("smallest and largest value of a plane: allowed are finite numbers in ascending order");
    try {
        (void)m.frame();
    } catch (const std::invalid_argument& e) {
        refuse(e.what());
    }
}

int obt_levels(std::int64_t width, std::int64_t height) {
    int levels = 1;
    for (std::int64_t size = std::max(width, height); size > obt::tile_samples; size = (size + 1) / 2)
        ++levels;
    return levels;
}

} // namespace obscura::terrain
