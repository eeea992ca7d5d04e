// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene/trajectory.hpp"

#include "config/csv.hpp"
#include "core/error.hpp"
#include "core/pose_range.hpp"
#include "core/units.hpp"
#include "renderer/scene/scene_keys.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace obscura::scene {
namespace {

/// Reports a row that does not come after the one before.
void check_order(const config::CsvRow& row, const std::vector<TimedPose>& before) {
    if (!before.empty() && row.values[0] <= before.back().time_s)
        row.fail(0, "time_s", fmt::format("{} does not come after {}", row.values[0], before.back().time_s));
}

/// Refuses values outside a range: of lengths those of which the squares are no numbers.
void check_range(const config::CsvRow& row, std::size_t column, std::string_view name, config::Range range) {
    const double value = row.values[column];
    if (!(value >= range.min && value <= range.max))
        row.fail(column, name, fmt::format("{:g} is outside {:g} to {:g}", value, range.min, range.max));
}

/// The quaternion as a unit quaternion; `column` is that of qw.
Quat checked(const config::CsvRow& row, std::size_t column, Quat q) {
    if (refusal_of_attitude(q))
        row.fail(column, "qw", fmt::format("|q| = {:.6g}, a unit quaternion is wanted", norm(q)));
    return normalized(q);
}

} // namespace

bool is_surface_trajectory(const std::filesystem::path& file) {
    return config::has_csv_column(file, "longitude_deg");
}

Trajectory read_trajectory(const std::filesystem::path& file) {
    const bool on_surface = is_surface_trajectory(file);
    using Columns = std::array<std::string_view, 3>;
    const Columns place =
        on_surface ? Columns{"longitude_deg", "latitude_deg", "altitude_m"} : Columns{"x_m", "y_m", "z_m"};
    const std::array<config::CsvColumn, 8> columns{{{.name = "time_s"},
                                                    {.name = place[0]},
                                                    {.name = place[1]},
                                                    {.name = place[2]},
                                                    {.name = "qw", .optional = true},
                                                    {.name = "qx", .optional = true},
                                                    {.name = "qy", .optional = true},
                                                    {.name = "qz", .optional = true}}};
    Trajectory trajectory;
    std::vector<TimedPose>& samples = trajectory.samples;
    config::read_csv(file, columns, [&](const config::CsvRow& row) {
        const auto& v = row.values;
        check_order(row, samples);
        const auto given = std::count_if(v.begin() + 4, v.end(), [](double x) { return !std::isnan(x); });
        if (samples.empty()) trajectory.has_attitude = given > 0;
        if (given != (trajectory.has_attitude ? 4 : 0))
            row.fail(4, "qw", "qw, qx, qy and qz are wanted in every row, or in none for positions only");
        for (std::size_t column = 1; column <= 3; ++column)
            check_range(row, column, columns[column].name,
                        on_surface && column < 3 ? (column == 1 ? longitudes_deg : latitudes_deg) : anywhere);
        const Quat q = trajectory.has_attitude ? Quat{v[4], v[5], v[6], v[7]} : Quat{};
        if (on_surface) trajectory.places.push_back({v[0], v[1] * degree, v[2] * degree, v[3]});
        const Vec3 position_m = on_surface ? Vec3{} : Vec3{v[1], v[2], v[3]};
        samples.push_back({v[0], {position_m, checked(row, 4, q)}});
    });
    if (samples.empty()) throw ConfigError(fmt::format("{}: no rows after the header", file.string()));
    return trajectory;
}

std::vector<TimedPose> read_attitudes(const std::filesystem::path& file) {
    std::vector<TimedPose> samples;
    config::read_csv(file, attitude_columns, [&](const config::CsvRow& row) {
        const auto& v = row.values;
        check_order(row, samples);
        samples.push_back({v[0], {{}, checked(row, 1, {v[1], v[2], v[3], v[4]})}});
    });
    if (samples.empty()) throw ConfigError(fmt::format("{}: no rows after the header", file.string()));
    return samples;
}

std::vector<scene::Joint::Sample> read_joint_table(const std::filesystem::path& file, std::string_view value,
                                                   double unit) {
    std::vector<scene::Joint::Sample> samples;
    config::read_csv(file, fmt::format("time_s,{}", value), [&](const config::CsvRow& row) {
        if (!samples.empty() && row.values[0] <= samples.back().time_s)
            row.fail(0, "time_s",
                     fmt::format("{} does not come after {}", row.values[0], samples.back().time_s));
        check_range(row, 1, value, anywhere);
        samples.push_back({row.values[0], row.values[1] * unit});
    });
    if (samples.empty()) throw ConfigError(fmt::format("{}: no rows after the header", file.string()));
    return samples;
}

} // namespace obscura::scene
