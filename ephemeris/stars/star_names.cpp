// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/stars/star_names.hpp"

#include "config/csv.hpp"
#include "config/shipped_files.hpp"
#include "core/io/path_state.hpp"
#include "core/units.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <string>

namespace obscura::ephemeris {
namespace {

constexpr double reach_deg = 0.01;

} // namespace

StarNames::StarNames() {
    const std::filesystem::path file = config::shipped_data_folder() / "star-names" / "bright.csv";
    if (!path_exists(file)) return;
    constexpr std::array columns{config::CsvColumn{"ra_deg"}, config::CsvColumn{"dec_deg"},
                                 config::CsvColumn{.name = "designation", .optional = true, .text = true},
                                 config::CsvColumn{.name = "name", .optional = true, .text = true}};
    config::read_csv(file, columns, [&](const config::CsvRow& row) {
        entries_.push_back(
            {row.values[1], row.values[0], {std::string(row.cells[2]), std::string(row.cells[3])}});
    });
    std::sort(entries_.begin(), entries_.end(),
              [](const Entry& a, const Entry& b) { return a.declination_deg < b.declination_deg; });
}

StarName StarNames::at(double right_ascension_rad, double declination_rad) const {
    const double ra = right_ascension_rad / degree, dec = declination_rad / degree;
    const auto first =
        std::lower_bound(entries_.begin(), entries_.end(), dec - reach_deg,
                         [](const Entry& e, double at_deg) { return e.declination_deg < at_deg; });
    StarName name;
    double nearest = reach_deg;
    for (auto e = first; e != entries_.end() && e->declination_deg <= dec + reach_deg; ++e) {
        const double across = std::remainder(ra - e->right_ascension_deg, 360) * std::cos(declination_rad);
        const double distance = std::hypot(across, dec - e->declination_deg);
        if (distance < nearest) nearest = distance, name = e->name;
    }
    return name;
}

} // namespace obscura::ephemeris
