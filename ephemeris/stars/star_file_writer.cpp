// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "ephemeris/stars/star_file.hpp"
#include "ephemeris/stars/star_file_layout.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <tuple>

namespace obscura::ephemeris {

using namespace star_layout;

namespace {

/// Stars of a sky cell that the grid aims at.
constexpr double stars_per_cell = 64;

std::uint32_t edge_for(std::size_t stars) {
    const double edge = std::sqrt(static_cast<double>(stars) / (6 * stars_per_cell));
    const auto groups = static_cast<std::uint32_t>(std::min(std::ceil(edge / SkyCells::group_edge), 1e6));
    return std::clamp(groups * SkyCells::group_edge, SkyCells::min_edge, std::uint32_t{128});
}

template<typename Integer>
Integer scaled(double value) {
    return static_cast<Integer>(std::llround(value * 1000));
}

void check(const CatalogueStar& star, std::size_t index) {
    const auto within = [&](double value, double most, std::string_view what) {
        if (!(std::abs(value) <= most))
            throw InputError(
                fmt::format("star {}: {} {}, allowed are -{} to {}", index + 1, what, value, most, most));
    };
    if (!is_finite(star.direction) || !(std::abs(length(star.direction) - 1) < 1e-6))
        throw InputError(fmt::format("star {}: its direction is not a unit vector", index + 1));
    within(star.motion_ra_mas_yr, max_motion_mas_yr, "proper motion");
    within(star.motion_dec_mas_yr, max_motion_mas_yr, "proper motion");
    within(star.parallax_mas, max_parallax_mas, "parallax");
    within(star.magnitude_v, max_magnitude, "V");
    if (!std::isnan(star.colour_b_v)) within(star.colour_b_v, max_magnitude, "B-V");
    if (!std::isnan(star.type_number)) within(star.type_number, 7, "number of the spectral type");
}

void put_record(const CatalogueStar& star, const FacePoint& at, std::byte* out) {
    const auto unit = [](double x) {
        return static_cast<std::uint32_t>(std::clamp((x + 1) * 0x1p31, 0.0, 4294967295.0));
    };
    put(out + record::u, unit(at.u));
    put(out + record::v, unit(at.v));
    put(out + record::motion_ra, scaled<std::int32_t>(star.motion_ra_mas_yr));
    put(out + record::motion_dec, scaled<std::int32_t>(star.motion_dec_mas_yr));
    put(out + record::parallax, scaled<std::int32_t>(star.parallax_mas));
    put(out + record::id, star.id);
    put(out + record::magnitude, scaled<std::int16_t>(star.magnitude_v));
    put(out + record::colour,
        std::isnan(star.colour_b_v) ? unknown_colour : scaled<std::int16_t>(star.colour_b_v));
    std::uint32_t type = 0;
    if (std::isnan(star.type_number))
        put(out + record::untyped_class, static_cast<std::uint8_t>(star.luminosity));
    else
        type = 1 +
               std::min(static_cast<std::uint32_t>(std::lround(std::max(0.0, star.type_number) * 100)),
                        max_type_hundredths) +
               luminosity_step * static_cast<std::uint32_t>(star.luminosity);
    put(out + record::type, static_cast<std::uint16_t>(type));
    put(out + record::face, static_cast<std::uint8_t>(at.face | static_cast<std::uint32_t>(star.ids) << 4U));
}

} // namespace

std::vector<std::byte> star_file_bytes(std::span<const CatalogueStar> stars, std::string_view source,
                                       std::optional<double> complete_v) {
    const SkyCells cells(edge_for(stars.size()));
    struct Place {
        std::uint32_t cell;
        std::int32_t magnitude; ///< mmag, as in the record
        std::size_t star;
    };
    std::vector<Place> places;
    places.reserve(stars.size());
    double motion = 0;
    double parallax = 0;
    for (std::size_t i = 0; i < stars.size(); ++i) {
        check(stars[i], i);
        places.push_back(
            {cells.cell_of(face_point(stars[i].direction)), scaled<std::int32_t>(stars[i].magnitude_v), i});
        motion = std::max(motion, std::hypot(stars[i].motion_ra_mas_yr, stars[i].motion_dec_mas_yr));
        parallax = std::max(parallax, std::abs(stars[i].parallax_mas));
    }
    std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
        return std::tie(a.cell, a.magnitude, a.star) < std::tie(b.cell, b.magnitude, b.star);
    });

    const std::size_t index_bytes = 4 * (std::size_t{cells.count()} + 1);
    std::vector<std::byte> out(header_bytes + index_bytes + record_bytes * stars.size());
    std::byte* const records = out.data() + header_bytes + index_bytes;
    std::size_t next = 0;
    for (std::uint32_t cell = 0; cell <= cells.count(); ++cell) {
        put(out.data() + header_bytes + 4 * std::size_t{cell}, static_cast<std::uint32_t>(next));
        for (; next < places.size() && places[next].cell == cell; ++next) {
            const CatalogueStar& star = stars[places[next].star];
            put_record(star, face_point(star.direction), records + next * record_bytes);
        }
    }
    const auto [brightest, faintest] =
        std::minmax_element(places.begin(), places.end(),
                            [](const Place& a, const Place& b) { return a.magnitude < b.magnitude; });
    std::byte* const start = out.data();
    std::transform(magic.begin(), magic.end(), start, [](char c) { return static_cast<std::byte>(c); });
    put(start + header::version, version);
    put(start + header::header_bytes, static_cast<std::uint32_t>(header_bytes));
    put(start + header::record_bytes, static_cast<std::uint32_t>(record_bytes));
    put(start + header::edge, cells.edge());
    put(start + header::stars, std::uint64_t{stars.size()});
    put(start + header::file_bytes, std::uint64_t{out.size()});
    put(start + header::brightest, places.empty() ? 0 : brightest->magnitude);
    put(start + header::faintest, places.empty() ? 0 : faintest->magnitude);
    put(start + header::complete, complete_v ? scaled<std::int32_t>(*complete_v) : unknown_completeness);
    put(start + header::motion, static_cast<std::uint32_t>(std::ceil(motion * 1000)));
    put(start + header::parallax, static_cast<std::uint32_t>(std::ceil(parallax * 1000)));
    const auto crc = [&](std::uint32_t before, std::size_t from, std::size_t bytes) {
        return static_cast<std::uint32_t>(
            crc32_z(before, reinterpret_cast<const Bytef*>(start + from), bytes));
    };
    put(start + header::records_crc, crc(0, header_bytes + index_bytes, record_bytes * stars.size()));
    source = source.substr(0, max_source_bytes);
    std::transform(source.begin(), source.end(), start + header::source,
                   [](char c) { return static_cast<std::byte>(c); });
    put(start + header::crc, crc(crc(0, 0, header::crc), header_bytes, index_bytes));
    return out;
}

} // namespace obscura::ephemeris
