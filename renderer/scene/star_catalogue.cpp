// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene/star_catalogue.hpp"

#include "config/csv.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>

namespace obscura::scene {
namespace {

constexpr std::array<config::CsvColumn, 5> star_columns{{
    {"ra_deg"},
    {"dec_deg"},
    {"v_mag"},
    {.name = "b_v", .optional = true},
    {.name = "spectral_type", .optional = true, .text = true},
}};

SpectralType::Luminosity luminosity_of(std::string_view text) {
    using enum SpectralType::Luminosity;
    const std::size_t at = text.find_first_of("IV");
    if (at == std::string_view::npos) return unknown;
    text.remove_prefix(at);
    if (text.starts_with("IV") || text.starts_with("V")) return dwarf;
    return text.starts_with("II") ? giant : supergiant;
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

std::vector<scene::Star> read_stars(const std::filesystem::path& file, double limiting_magnitude) {
    constexpr double degree = std::numbers::pi / 180;
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
        if (v[2] > limiting_magnitude) return;
        Star star{v[0] * degree, v[1] * degree, v[2]};
        if (!std::isnan(v[3])) star.colour_b_v = v[3];
        star.type = parse_spectral_type(row.cells[4]);
        stars.push_back(star);
    });
    return stars;
}

} // namespace obscura::scene
