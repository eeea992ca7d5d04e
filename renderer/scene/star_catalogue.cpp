// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene/star_catalogue.hpp"

#include "config/csv.hpp"
#include "core/units.hpp"
#include "ephemeris/stars/luminosity_class.hpp"
#include "ephemeris/stars/star_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace obscura::scene {
namespace {

constexpr std::array<config::CsvColumn, 6> star_columns{{
    {"ra_deg"},
    {"dec_deg"},
    {"v_mag"},
    {.name = "b_v", .optional = true},
    {.name = "spectral_type", .optional = true, .text = true},
    {.name = "parallax_mas", .optional = true},
}};

SpectralType::Luminosity luminosity_of(std::string_view text) {
    using enum SpectralType::Luminosity;
    const std::size_t at = text.find_first_of("IV");
    if (at == std::string_view::npos) return unknown;
    text.remove_prefix(at);
    if (text.starts_with("IV") || text.starts_with("V")) return dwarf;
    return text.starts_with("II") ? giant : supergiant;
}

SpectralType::Luminosity luminosity_of(ephemeris::Luminosity luminosity) {
    using enum SpectralType::Luminosity;
    switch (luminosity) {
    case ephemeris::Luminosity::dwarf:
        return dwarf;
    case ephemeris::Luminosity::giant:
        return giant;
    case ephemeris::Luminosity::supergiant:
        return supergiant;
    case ephemeris::Luminosity::unknown:
        break;
    }
    return unknown;
}

} // namespace

std::optional<SpectralType> parse_spectral_type(std::string_view text) {
    constexpr std::string_view letters = "OBAFGKM";
    const std::size_t letter = text.empty() ? std::string_view::npos : letters.find(text.front());
    if (letter == std::string_view::npos) return std::nullopt;
    const auto digit = [&](std::size_t at) {
        return at < text.size() && text[at] >= '0' && text[at] <= '9' ? text[at] - '0' : -1;
    };
    double subclass = 5;
    if (digit(1) >= 0) {
        subclass = digit(1);
        if (text.size() > 2 && text[2] == '.' && digit(3) >= 0) subclass += 0.1 * digit(3);
    }
    return SpectralType{static_cast<double>(letter) + subclass / 10, luminosity_of(text.substr(1))};
}

namespace {

/// Type of a row of `star_columns`; the luminosity class by the parallax if the text has none.
std::optional<SpectralType> type_of_row(const config::CsvRow& row) {
    std::optional<SpectralType> type = parse_spectral_type(row.cells[4]);
    if (type && type->luminosity != SpectralType::Luminosity::unknown) return type;
    ephemeris::CatalogueStar star;
    star.magnitude_v = row.values[2];
    star.colour_b_v = row.values[3];
    star.parallax_mas = row.values[5];
    if (type) star.type_number = type->number;
    const ephemeris::Luminosity luminosity = ephemeris::luminosity_from_parallax(star);
    if (luminosity != ephemeris::Luminosity::unknown)
        type = SpectralType{star.type_number, luminosity_of(luminosity)};
    return type;
}

} // namespace

std::vector<scene::Star> read_stars(const std::filesystem::path& file, double limiting_magnitude) {
    std::vector<scene::Star> stars;
    config::read_csv(file, star_columns, [&](const config::CsvRow& row) {
        const auto& v = row.values;
        const auto check = [&](std::size_t index, double min, double max) {
            if (v[index] < min || v[index] > max)
                row.fail(index, star_columns[index].name,
                         fmt::format("{} is out of range, allowed {} to {}", v[index], min, max));
        };
        check(0, 0, 360);
        check(1, -90, 90);
        check(2, -30, 40);
        check(3, -5, 20);
        check(5, 0, 1000);
        if (v[2] > limiting_magnitude) return;
        Star star{v[0] * degree, v[1] * degree, v[2]};
        if (!std::isnan(v[3])) star.colour_b_v = v[3];
        star.type = type_of_row(row);
        stars.push_back(star);
    });
    return stars;
}

std::vector<SkyObject> read_star_irradiances(const std::filesystem::path& file, std::size_t bands) {
    std::vector<std::string> names{"x", "y", "z"};
    for (std::size_t b = 1; b <= bands; ++b)
        names.push_back(fmt::format("e{}", b));
    std::vector<config::CsvColumn> columns;
    for (const std::string& name : names)
        columns.push_back({name});
    std::vector<SkyObject> stars;
    config::read_csv(file, columns, [&](const config::CsvRow& row) {
        const std::span<const double> v = row.values;
        SkyObject& star = stars.emplace_back();
        const Vec3 direction{v[0], v[1], v[2]};
        if (!(length(direction) > 0)) row.fail(0, names[0], "a direction of length 0");
        star.star.right_ascension_rad = std::atan2(direction.y, direction.x);
        star.star.declination_rad = std::atan2(direction.z, std::hypot(direction.x, direction.y));
        star.irradiance_w_m2.assign(v.begin() + 3, v.end());
        for (std::size_t b = 0; b < bands; ++b)
            if (star.irradiance_w_m2[b] < 0) row.fail(3 + b, names[3 + b], "is less than 0");
    });
    return stars;
}

Star photometric_star(const ephemeris::CatalogueStar& from, StarSpectrum spectrum) {
    Star star;
    star.magnitude_v = from.magnitude_v;
    if (!std::isnan(from.colour_b_v)) star.colour_b_v = from.colour_b_v;
    if (!std::isnan(from.type_number) || from.luminosity != ephemeris::Luminosity::unknown)
        star.type = SpectralType{from.type_number, luminosity_of(from.luminosity)};
    star.spectrum = spectrum;
    return star;
}

Star star_of(const Scene& scene, std::uint32_t number) {
    if (number < scene.stars.size()) return scene.stars[number];
    const ephemeris::CatalogueStar from =
        scene.catalogue.file->star(number - static_cast<std::uint32_t>(scene.stars.size()));
    Star star = photometric_star(from, scene.catalogue.spectrum);
    const Vec3 d = from.direction;
    const double longitude = std::atan2(d.y, d.x);
    star.right_ascension_rad = longitude < 0 ? longitude + 2 * std::numbers::pi : longitude;
    star.declination_rad = std::atan2(d.z, std::hypot(d.x, d.y));
    return star;
}

StarTotals star_totals(const Scene& scene) {
    StarTotals totals;
    const auto add = [&](double magnitude_v) {
        totals.faintest_v = totals.count == 0 ? magnitude_v : std::max(totals.faintest_v, magnitude_v);
        ++totals.count;
    };
    for (const Star& star : scene.stars)
        add(star.magnitude_v);
    if (const ephemeris::StarFile* const file = scene.catalogue.file.get())
        file->for_each({{1, 0, 0}, std::numbers::pi}, scene.catalogue.limiting_v,
                       [&](std::uint32_t i) { add(file->magnitude_v(i)); });
    return totals;
}

} // namespace obscura::scene
