// SPDX-License-Identifier: Apache-2.0
#include "tools/import/stars/star_rows.hpp"

#include "core/text/number.hpp"
#include "core/text/text.hpp"
#include "core/units.hpp"
#include "ephemeris/stars/luminosity_class.hpp"
#include "renderer/scene/star_catalogue.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <vector>

namespace obscura::tools {

using ephemeris::CatalogueStar;
using ephemeris::StarIds;

namespace {

constexpr std::string_view no_place = "no position, or one that is not possible";
constexpr std::string_view no_magnitude = "no magnitude";
constexpr std::string_view too_short = "too few fields";
constexpr std::string_view blanks = " \t\r\"";

std::vector<std::string_view> split_row(std::string_view line, char separator) {
    std::vector<std::string_view> fields;
    while (true) {
        const auto end = line.find(separator);
        fields.push_back(trimmed(line.substr(0, end), blanks));
        if (end == std::string_view::npos) return fields;
        line.remove_prefix(end + 1);
    }
}

double or_zero(double value) {
    return std::isnan(value) ? 0 : value;
}

std::uint64_t whole(std::string_view field) {
    std::uint64_t value = 0;
    field = trimmed(field, blanks);
    std::from_chars(field.data(), field.data() + field.size(), value);
    return value;
}

StarRow misplaced(std::string_view ra, std::string_view dec) {
    return StarRow::refuse(no_place, fmt::format("\"{}\" \"{}\"", ra.substr(0, 20), dec.substr(0, 20)));
}

/// Numbers separated by blanks; false if there are not as many, or not all are numbers.
template<std::size_t Count>
bool read_numbers(std::string_view line, std::array<double, Count>& values) {
    for (double& value : values) {
        line = trimmed(line, blanks);
        const auto end = std::min(line.find_first_of(" \t"), line.size());
        value = star_number(line.substr(0, end));
        if (!std::isfinite(value)) return false;
        line.remove_prefix(end);
    }
    return trimmed(line, blanks).empty();
}

/// Clamped polynomial of Riello et al. (2021).
template<std::size_t Count>
double relation(const std::array<double, Count>& coefficients, double x, double from, double to) {
    x = std::clamp(x, from, to);
    double value = 0;
    for (std::size_t i = Count; i-- > 0;)
        value = value * x + coefficients[i];
    return value;
}

class CsvRows final : public StarRowReader {
public:
    StarRow read(std::string_view line, std::uint64_t number) override {
        line = trimmed(line, blanks);
        if (line.empty() || line.front() == '#') return StarRow::skip();
        const std::vector<std::string_view> fields = split_row(line, ',');
        if (!has_heading_) {
            has_heading_ = true;
            names_.assign(fields.begin(), fields.end());
            for (std::size_t i = 0; i < names_.size(); ++i)
                std::transform(names_[i].begin(), names_[i].end(), names_[i].begin(), [](unsigned char c) {
                    return static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
                });
            return StarRow::skip();
        }
        if (fields.size() != names_.size())
            return StarRow::refuse("another number of fields than in the heading",
                                   fmt::format("{} instead of {}", fields.size(), names_.size()));
        const auto text = [&](std::initializer_list<std::string_view> wanted) {
            for (const std::string_view name : wanted)
                for (std::size_t i = 0; i < names_.size(); ++i)
                    if (names_[i] == name) return fields[i];
            return std::string_view{};
        };
        const std::string_view ra = text({"ra_deg", "ra"});
        const std::string_view dec = text({"dec_deg", "dec"});
        CatalogueStar star;
        if (!set_place(star_number(ra), star_number(dec), star)) return misplaced(ra, dec);
        star.motion_ra_mas_yr = or_zero(star_number(text({"pmra"})));
        star.motion_dec_mas_yr = or_zero(star_number(text({"pmdec"})));
        star.parallax_mas = or_zero(star_number(text({"parallax", "parallax_mas"})));
        star.magnitude_v = star_number(text({"v_mag"}));
        star.colour_b_v = star_number(text({"b_v"}));
        set_type(text({"spectral_type"}), star);
        const double g = star_number(text({"phot_g_mean_mag"}));
        const bool gaia = !std::isnan(g);
        if (std::isnan(star.magnitude_v) && gaia) {
            const JohnsonColours colours = johnson_from_gaia(g, star_number(text({"bp_rp"})));
            star.magnitude_v = colours.v;
            star.colour_b_v = colours.b_v;
        }
        if (std::isnan(star.magnitude_v)) return StarRow::refuse(no_magnitude);
        constexpr double gaia_year = 2016; // J2016.0 of Gaia EDR3 and DR3
        const double year = star_number(text({"ref_epoch"}));
        move_to_j2000(!std::isnan(year) ? year : gaia ? gaia_year : 2000, star);
        star.id = number;
        if (const std::string_view id = text({"source_id"}); !id.empty())
            star.ids = StarIds::gaia, star.id = whole(id);
        else if (const std::string_view hip = text({"hip"}); !hip.empty())
            star.ids = StarIds::hipparcos, star.id = whole(hip);
        return checked(star, star_number(text({"parallax_error"})));
    }

private:
    bool has_heading_ = false;
    std::vector<std::string> names_;
};

class HipparcosRows final : public StarRowReader {
public:
    StarRow read(std::string_view line, std::uint64_t /*number*/) override {
        // Fields of the catalogue's table 2.1.1.
        constexpr std::size_t hip = 1, v = 5, ra = 8, dec = 9, parallax = 11, motion_ra = 12, motion_dec = 13,
                              parallax_error = 16, colour = 37, type = 76, count = 77;
        if (trimmed(line, blanks).empty()) return StarRow::skip();
        const std::vector<std::string_view> fields = split_row(line, '|');
        if (fields.size() < count) return StarRow::refuse(too_short);
        CatalogueStar star;
        if (!set_place(star_number(fields[ra]), star_number(fields[dec]), star))
            return misplaced(fields[ra], fields[dec]);
        star.magnitude_v = star_number(fields[v]);
        if (std::isnan(star.magnitude_v)) return StarRow::refuse(no_magnitude);
        star.motion_ra_mas_yr = or_zero(star_number(fields[motion_ra]));
        star.motion_dec_mas_yr = or_zero(star_number(fields[motion_dec]));
        star.parallax_mas = or_zero(star_number(fields[parallax]));
        star.colour_b_v = star_number(fields[colour]);
        set_type(fields[type], star);
        constexpr double hipparcos_year = 1991.25;
        move_to_j2000(hipparcos_year, star);
        star.ids = StarIds::hipparcos;
        star.id = whole(fields[hip]);
        return checked(star, star_number(fields[parallax_error]));
    }
};

class Tycho2Rows final : public StarRowReader {
public:
    StarRow read(std::string_view line, std::uint64_t /*number*/) override {
        // Fields of the catalogue's "Guide", table 1: mean place at J2000.0; where there is none, the place
        // observed, of about 1991.5.
        constexpr std::size_t id = 0, ra = 2, dec = 3, motion_ra = 4, motion_dec = 5, bt = 17, vt = 19,
                              observed_ra = 24, observed_dec = 25, count = 26;
        if (trimmed(line, blanks).empty()) return StarRow::skip();
        const std::vector<std::string_view> fields = split_row(line, '|');
        if (fields.size() < count) return StarRow::refuse(too_short);
        CatalogueStar star;
        if (!set_place(star_number(fields[ra]), star_number(fields[dec]), star) &&
            !set_place(star_number(fields[observed_ra]), star_number(fields[observed_dec]), star))
            return misplaced(fields[ra], fields[dec]);
        const JohnsonColours colours = johnson_from_tycho(star_number(fields[bt]), star_number(fields[vt]));
        if (std::isnan(colours.v)) return StarRow::refuse(no_magnitude);
        star.magnitude_v = colours.v;
        star.colour_b_v = colours.b_v;
        star.motion_ra_mas_yr = or_zero(star_number(fields[motion_ra]));
        star.motion_dec_mas_yr = or_zero(star_number(fields[motion_dec]));
        // Region, number within it, component: the catalogue has up to 9537, 12121 and 3.
        std::array<double, 3> parts{};
        constexpr std::array most{9999.0, 99'999.0, 9.0};
        if (!read_numbers(fields[id], parts)) return StarRow::refuse("no TYC number");
        for (std::size_t i = 0; i < parts.size(); ++i)
            if (!(parts[i] >= 0 && parts[i] <= most[i])) return StarRow::refuse("TYC number not possible");
        star.ids = StarIds::tycho;
        star.id =
            ephemeris::tycho_id(static_cast<std::uint64_t>(parts[0]), static_cast<std::uint64_t>(parts[1]),
                                static_cast<std::uint64_t>(parts[2]));
        return checked(star);
    }
};

class KstarsRows final : public StarRowReader {
public:
    StarRow read(std::string_view line, std::uint64_t number) override {
        if (trimmed(line, blanks).empty() || line.front() == '#') return StarRow::skip();
        constexpr std::size_t least = 58;
        if (line.size() < least) return StarRow::refuse(too_short);
        const auto value = [&](std::size_t from, std::size_t to) {
            return star_number(line.substr(from, to - from));
        };
        const double ra = 15 * (value(0, 2) + value(2, 4) / 60 + value(4, 9) / 3600);
        const double dec = value(11, 13) + value(13, 15) / 60 + value(15, 19) / 3600;
        CatalogueStar star;
        if (!set_place(ra, line[10] == '-' ? -dec : dec, star))
            return misplaced(line.substr(0, 9), line.substr(10, 9));
        star.motion_ra_mas_yr = or_zero(value(20, 29));
        star.motion_dec_mas_yr = or_zero(value(29, 38));
        star.parallax_mas = or_zero(value(38, 45));
        star.magnitude_v = value(46, 51);
        if (std::isnan(star.magnitude_v)) return StarRow::refuse(no_magnitude);
        star.colour_b_v = value(51, 56);
        const std::string_view type = trimmed(line.substr(56, 2), blanks);
        set_type(type, star);
        star.id = number;
        return checked(star, kstars_parallax_error_mas(type));
    }
};

class StarMapRows final : public StarRowReader {
public:
    explicit StarMapRows(const StarMapScale& scale) : scale_(scale) {}

    StarRow read(std::string_view line, std::uint64_t number) override {
        if (trimmed(line, blanks).empty()) return StarRow::skip();
        if (!has_count_) {
            has_count_ = true;
            if (!std::isnan(star_number(line))) return StarRow::skip();
        }
        std::array<double, 7> v{};
        if (!read_numbers(line, v)) return StarRow::refuse("not seven finite numbers");
        CatalogueStar star;
        star.direction = {v[0], v[1], v[2]};
        const double norm = length(star.direction);
        constexpr double rounding = 1e-3;
        if (!(std::abs(norm - 1) < rounding))
            return StarRow::refuse("direction is not a unit vector", fmt::format("length {}", norm));
        star.direction = star.direction / norm;
        const double irradiance =
            scale_.channel >= 0 ? v[3 + static_cast<std::size_t>(scale_.channel)] : (v[3] + v[4] + v[5]) / 3;
        if (!(irradiance > 0)) return StarRow::refuse("no irradiance above 0", fmt::format("{}", irradiance));
        star.magnitude_v = -2.5 * std::log10(irradiance / scale_.zero_w_m2);
        star.id = number;
        return checked(star);
    }

private:
    StarMapScale scale_;
    bool has_count_ = false;
};

} // namespace

double star_number(std::string_view field) {
    return decimal_number(trimmed(field, blanks)).value_or(CatalogueStar::unknown);
}

bool set_place(double right_ascension_deg, double declination_deg, CatalogueStar& star) {
    if (!(right_ascension_deg >= 0 && right_ascension_deg <= 360) || !(std::abs(declination_deg) <= 90))
        return false;
    star.direction = ephemeris::direction_of(right_ascension_deg * degree, declination_deg * degree);
    return true;
}

void move_to_j2000(double year, CatalogueStar& star) {
    constexpr double max_years = 1000;
    star.direction = direction_at(star, std::clamp(2000 - year, -max_years, max_years), {});
}

void set_type(std::string_view text, CatalogueStar& star) {
    const auto type = scene::parse_spectral_type(text);
    if (!type) return;
    star.type_number = type->number;
    using Luminosity = scene::SpectralType::Luminosity;
    star.luminosity = type->luminosity == Luminosity::dwarf        ? ephemeris::Luminosity::dwarf
                      : type->luminosity == Luminosity::giant      ? ephemeris::Luminosity::giant
                      : type->luminosity == Luminosity::supergiant ? ephemeris::Luminosity::supergiant
                                                                   : ephemeris::Luminosity::unknown;
}

StarRow checked(const CatalogueStar& star, double parallax_error_mas) {
    const auto outside = [](double value, double from, double to) { return !(value >= from && value <= to); };
    // The fastest star moves by 10.4 arc seconds a year, and the largest parallax is 0.77.
    constexpr double max_motion = 20'000, max_parallax = 1000;
    if (outside(star.magnitude_v, -30, 32))
        return StarRow::refuse("magnitude not possible", fmt::format("V {}", star.magnitude_v));
    if (outside(star.motion_ra_mas_yr, -max_motion, max_motion) ||
        outside(star.motion_dec_mas_yr, -max_motion, max_motion))
        return StarRow::refuse("proper motion not possible",
                               fmt::format("{}, {} mas/yr", star.motion_ra_mas_yr, star.motion_dec_mas_yr));
    if (outside(star.parallax_mas, -max_parallax, max_parallax))
        return StarRow::refuse("parallax not possible", fmt::format("{} mas", star.parallax_mas));
    StarRow row{StarRow::Kind::star, star};
    // Negative ones are errors of measurement about a small value.
    row.star.parallax_mas = std::max(0.0, star.parallax_mas);
    if (outside(star.colour_b_v, -5, 20)) row.star.colour_b_v = CatalogueStar::unknown;
    if (row.star.luminosity == ephemeris::Luminosity::unknown) {
        row.star.luminosity = luminosity_from_parallax(row.star, parallax_error_mas);
        row.class_from_parallax = row.star.luminosity != ephemeris::Luminosity::unknown;
    }
    return row;
}

double kstars_parallax_error_mas(std::string_view type) {
    constexpr double tycho_error_mas = 11;
    return type.find('?') == std::string_view::npos ? CatalogueStar::unknown : tycho_error_mas;
}

JohnsonColours johnson_from_tycho(double bt, double vt) {
    if (std::isnan(vt)) return {};
    // Without a colour: the median of V - VT of 123,000 stars of V > 6 in both Hipparcos and Tycho-2.
    constexpr double median_v_vt = -0.08;
    if (std::isnan(bt)) return {vt + median_v_vt};
    return {vt - 0.090 * (bt - vt), 0.850 * (bt - vt)};
}

JohnsonColours johnson_from_gaia(double g, double bp_rp) {
    constexpr std::array g_v{-0.02704, 0.01424, -0.2156, 0.01426};
    constexpr std::array g_vt{-0.01077, -0.0682, -0.2387, 0.02342};
    constexpr std::array g_bt{-0.004288, -0.8547, 0.1244, -0.9085, 0.4843, -0.06814};
    constexpr double median_bp_rp = 0.8;
    if (std::isnan(bp_rp)) return {g - relation(g_v, median_bp_rp, -0.5, 5)};
    const double bt_vt = relation(g_vt, bp_rp, -0.3, 3) - relation(g_bt, bp_rp, -0.3, 3);
    return {g - relation(g_v, bp_rp, -0.5, 5), johnson_from_tycho(bt_vt, 0).b_v};
}

std::unique_ptr<StarRowReader> star_csv_rows() {
    return std::make_unique<CsvRows>();
}
std::unique_ptr<StarRowReader> hipparcos_rows() {
    return std::make_unique<HipparcosRows>();
}
std::unique_ptr<StarRowReader> tycho2_rows() {
    return std::make_unique<Tycho2Rows>();
}
std::unique_ptr<StarRowReader> kstars_rows() {
    return std::make_unique<KstarsRows>();
}
std::unique_ptr<StarRowReader> star_map_rows(const StarMapScale& scale) {
    return std::make_unique<StarMapRows>(scale);
}

} // namespace obscura::tools
