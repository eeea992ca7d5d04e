// SPDX-License-Identifier: Apache-2.0
#include "tools/pictures/star_lists.hpp"

#include "core/error.hpp"
#include "core/geometry.hpp"
#include "core/io/input_file.hpp"
#include "core/io/path_state.hpp"
#include "core/text/suggestion.hpp"
#include "core/units.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <numbers>

namespace obscura::tools {
namespace {

constexpr double arc_second = degree / 3600;
constexpr std::size_t max_list_line_bytes = 65536, max_stars = 10'000'000;

/// Columns of brightness that are known, the best first.
constexpr std::array<std::string_view, 10> brightness_columns{
    "mag",     "v_mag",        "magnitude_v",    "V", "flux", "flux_e", "signal_e",
    "flux_dn", "flux_meas_dn", "irradiance_w_m2"};

bool is_magnitude(std::string_view column) {
    return column.starts_with("mag") || column.ends_with("mag") || column == "V";
}

std::vector<std::string_view> cells_of(std::string_view line) {
    std::vector<std::string_view> cells;
    while (true) {
        const std::size_t comma = line.find(',');
        std::string_view cell = line.substr(0, comma);
        while (!cell.empty() && (cell.front() == ' ' || cell.front() == '\t'))
            cell.remove_prefix(1);
        while (!cell.empty() && (cell.back() == ' ' || cell.back() == '\t' || cell.back() == '\r'))
            cell.remove_suffix(1);
        cells.push_back(cell);
        if (comma == std::string_view::npos) return cells;
        line.remove_prefix(comma + 1);
    }
}

/// NaN for what is no finite number.
double star_number(std::string_view cell) {
    double value = 0;
    const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    if (error != std::errc{} || end != cell.data() + cell.size() || !std::isfinite(value))
        return std::numeric_limits<double>::quiet_NaN();
    return value;
}

/// Next line that is neither empty nor a comment. Throws InputError if it is too long.
bool next_line(std::istream& in, const std::filesystem::path& file, std::string& line, std::size_t& at) {
    while (std::getline(in, line)) {
        ++at;
        if (line.size() > max_list_line_bytes)
            throw InputError(
                fmt::format("{}:{}: a line of more than {} bytes", file.string(), at, max_list_line_bytes));
        if (!line.empty() && line.front() != '#' && line != "\r") return true;
    }
    return false;
}

struct Columns {
    std::size_t x = 0, y = 0;
    bool on_sky = false;
};

std::optional<std::size_t> place_of(const std::vector<std::string_view>& names, std::string_view name) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) return std::nullopt;
    return static_cast<std::size_t>(found - names.begin());
}

std::optional<Columns> columns_of(const std::vector<std::string_view>& names) {
    constexpr std::array<std::array<std::string_view, 2>, 3> pairs{
        {{"x_px", "y_px"}, {"x", "y"}, {"ra_deg", "dec_deg"}}};
    for (const auto& pair : pairs) {
        const auto x = place_of(names, pair[0]), y = place_of(names, pair[1]);
        if (x && y) return Columns{*x, *y, pair[0] == "ra_deg"};
    }
    return std::nullopt;
}

/// Place on which distances are those of the list's unit.
Vec3 point_of(const ListedStar& star, bool on_sky) {
    if (!on_sky) return {star.x, star.y, 0};
    const double c = std::cos(star.y);
    return Vec3{c * std::cos(star.x), c * std::sin(star.x), std::sin(star.y)} / arc_second;
}

/// Fills right and down of a pair.
void set_offset(StarPair& pair, const ListedStar& from, const ListedStar& to, bool on_sky) {
    if (!on_sky) {
        pair.right = to.x - from.x;
        pair.down = to.y - from.y;
        return;
    }
    pair.right = std::remainder(to.x - from.x, 2 * std::numbers::pi) * std::cos(from.y) / arc_second;
    pair.down = (to.y - from.y) / arc_second;
}

} // namespace

bool is_star_list(const std::filesystem::path& file) {
    if (!is_file_at(file)) return false;
    std::ifstream in(file, std::ios::binary);
    std::array<char, 4096> start{};
    in.read(start.data(), start.size());
    std::string_view text(start.data(), static_cast<std::size_t>(in.gcount()));
    while (!text.empty()) {
        const std::string_view line = text.substr(0, text.find('\n'));
        if (!line.empty() && line.front() != '#' && line != "\r")
            return columns_of(cells_of(line)).has_value();
        text.remove_prefix(std::min(text.size(), line.size() + 1));
    }
    return false;
}

StarList read_star_list(const std::filesystem::path& file, const StarListChoice& choice) {
    require_regular_file(file);
    std::ifstream in(file, std::ios::binary);
    if (!in) throw InputError(fmt::format("{}: cannot be read", file.string()), errno);
    std::string heading;
    std::size_t at = 0;
    if (!next_line(in, file, heading, at)) throw InputError(fmt::format("{}: empty", file.string()));
    const std::vector<std::string_view> names = cells_of(heading);
    const auto columns = columns_of(names);
    if (!columns)
        throw InputError(fmt::format("{}:{}: no columns x_px and y_px, x and y, or ra_deg and dec_deg",
                                     file.string(), at));
    StarList list;
    list.on_sky = columns->on_sky;
    std::optional<std::size_t> brightness;
    if (!choice.brightness.empty()) {
        brightness = place_of(names, choice.brightness);
        if (!brightness)
            throw InputError(fmt::format("{}:{}: no column {}, {}", file.string(), at, choice.brightness,
                                         allowed_words(choice.brightness, names)));
    }
    for (const std::string_view name : brightness_columns)
        if (!brightness) brightness = place_of(names, name);
    if (brightness) list.brightness = names[*brightness];
    const bool magnitudes = brightness && is_magnitude(list.brightness);
    std::vector<std::pair<std::size_t, std::string_view>> wanted;
    for (const std::string& row : choice.rows) {
        const std::size_t equals = row.find('=');
        if (const auto column = place_of(names, std::string_view(row).substr(0, equals)))
            wanted.emplace_back(*column, std::string_view(row).substr(std::min(row.size(), equals + 1)));
    }
    std::string line;
    while (next_line(in, file, line, at)) {
        const std::vector<std::string_view> cells = cells_of(line);
        if (cells.size() != names.size())
            throw InputError(fmt::format("{}:{}: {} fields, the heading has {}", file.string(), at,
                                         cells.size(), names.size()));
        if (std::any_of(wanted.begin(), wanted.end(),
                        [&](const auto& w) { return cells[w.first] != w.second; }))
            continue;
        ListedStar star{star_number(cells[columns->x]), star_number(cells[columns->y]), std::nullopt, at};
        if (std::isnan(star.x) || std::isnan(star.y))
            throw InputError(fmt::format("{}:{}: no position: \"{}\", \"{}\"", file.string(), at,
                                         cells[columns->x], cells[columns->y]));
        if (list.on_sky && !(star.x >= 0 && star.x <= 360 && std::abs(star.y) <= 90))
            throw InputError(fmt::format("{}:{}: {}, {} deg is no position on the sky", file.string(), at,
                                         star.x, star.y));
        if (list.on_sky) star.x *= degree, star.y *= degree;
        if (brightness) {
            const double value = star_number(cells[*brightness]);
            if (magnitudes && !std::isnan(value)) star.mag = value;
            if (!magnitudes && value > 0) star.mag = -2.5 * std::log10(value);
        }
        if (list.stars.size() == max_stars)
            throw InputError(fmt::format("{}:{}: more than {} stars", file.string(), at, max_stars));
        list.stars.push_back(star);
    }
    return list;
}

StarAgreement compare_star_lists(const StarList& reference, const StarList& list, double radius) {
    if (reference.on_sky != list.on_sky)
        throw InputError("obscura compare: one list has pixels, the other right ascension and declination");
    struct Point {
        Vec3 at;
        std::size_t star;
    };
    std::vector<Point> points;
    for (std::size_t i = 0; i < list.stars.size(); ++i)
        points.push_back({point_of(list.stars[i], list.on_sky), i});
    std::sort(points.begin(), points.end(), [](const Point& a, const Point& b) { return a.at.y < b.at.y; });
    struct Candidate {
        double distance;
        std::size_t reference, star;
    };
    std::vector<Candidate> candidates;
    for (std::size_t r = 0; r < reference.stars.size(); ++r) {
        const Vec3 at = point_of(reference.stars[r], reference.on_sky);
        for (auto p = std::lower_bound(points.begin(), points.end(), at.y - radius,
                                       [](const Point&a, double y) { return a.at.y < y; });
             p != points.end() && p->at.y <= at.y + radius; ++p)
            if (const double distance = length(p->at - at); distance <= radius)
                candidates.push_back({distance, r, p->star});
    }
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.distance < b.distance; });
    std::vector<bool> taken_reference(reference.stars.size()), taken(list.stars.size());
    StarAgreement out;
    double sum2 = 0;
    for (const Candidate& c : candidates) {
        if (taken_reference[c.reference] || taken[c.star]) continue;
        taken_reference[c.reference] = taken[c.star] = true;
        StarPair pair{c.reference, c.star, 0, 0, std::nullopt};
        const ListedStar& from = reference.stars[c.reference];
        const ListedStar& to = list.stars[c.star];
        set_offset(pair, from, to, reference.on_sky);
        if (from.mag && to.mag) pair.mag_offset = *to.mag - *from.mag;
        out.pairs.push_back(pair);
        out.largest = std::max(out.largest, c.distance);
    }
    std::sort(out.pairs.begin(), out.pairs.end(),
              [](const StarPair& a, const StarPair& b) { return a.reference < b.reference; });
    if (out.pairs.empty()) return out;
    const auto n = static_cast<double>(out.pairs.size());
    for (const StarPair& pair : out.pairs) {
        out.shift_right += pair.right / n;
        out.shift_down += pair.down / n;
        sum2 += pair.right * pair.right + pair.down * pair.down;
        if (!pair.mag_offset) continue;
        ++out.with_mag;
        out.zero_point += *pair.mag_offset;
    }
    out.rms = std::sqrt(sum2 / n);
    out.zero_point /= static_cast<double>(std::max<std::size_t>(out.with_mag, 1));
    double shifted2 = 0, mag2 = 0;
    for (const StarPair& pair : out.pairs) {
        const double right = pair.right - out.shift_right, down = pair.down - out.shift_down;
        shifted2 += right * right + down * down;
        if (pair.mag_offset) mag2 += std::pow(*pair.mag_offset - out.zero_point, 2);
    }
    out.rms_shifted = std::sqrt(shifted2 / n);
    out.zero_point_rms = std::sqrt(mag2 / static_cast<double>(std::max<std::size_t>(out.with_mag, 1)));
    return out;
}

} // namespace obscura::tools
