// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene/star_catalogue.hpp"

#include "config/csv.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace obscura::scene {

std::vector<scene::Star> read_stars(const std::filesystem::path& file, double limiting_magnitude) {
    constexpr double degree = std::numbers::pi / 180;
    std::vector<scene::Star> stars;
    config::read_csv(file, star_columns, [&](const config::CsvRow& row) {
        const auto& v = row.values;
        const auto check = [&](std::size_t index, const char* name, double min, double max) {
            if (v[index] < min || v[index] > max)
                row.fail(index, name,
                         fmt::format("{} is out of range, allowed {} to {}", v[index], min, max));
        };
        check(0, "ra_deg", 0, 360);
        check(1, "dec_deg", -90, 90);
        check(2, "v_mag", -30, 40);
        check(3, "b_v", -5, 20);
        if (v[2] <= limiting_magnitude) stars.push_back({v[0] * degree, v[1] * degree, v[2], v[3]});
    });
    return stars;
}

} // namespace obscura::scene
