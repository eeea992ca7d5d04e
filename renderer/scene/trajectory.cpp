// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene/trajectory.hpp"

#include "config/csv.hpp"
#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace obscura::scene {

Trajectory read_trajectory(const std::filesystem::path& file) {
    const std::array<config::CsvColumn, 8> columns{{{.name = "time_s"},
                                                    {.name = "x_m"},
                                                    {.name = "y_m"},
                                                    {.name = "z_m"},
                                                    {.name = "qw", .optional = true},
                                                    {.name = "qx", .optional = true},
                                                    {.name = "qy", .optional = true},
                                                    {.name = "qz", .optional = true}}};
    Trajectory trajectory;
    std::vector<TimedPose>& samples = trajectory.samples;
    config::read_csv(file, columns, [&](const config::CsvRow& row) {
        const auto& v = row.values;
        if (!samples.empty() && v[0] <= samples.back().time_s)
            row.fail(0, "time_s", fmt::format("{} does not come after {}", v[0], samples.back().time_s));
        const auto given = std::count_if(v.begin() + 4, v.end(), [](double x) { return !std::isnan(x); });
        if (samples.empty()) trajectory.has_attitude = given > 0;
        if (given != (trajectory.has_attitude ? 4 : 0))
            row.fail(4, "qw", "qw, qx, qy and qz are wanted in every row, or in none for positions only");
        const Quat q = trajectory.has_attitude ? Quat{v[4], v[5], v[6], v[7]} : Quat{};
        if (!(std::abs(norm(q) - 1) <= 1e-3))
            row.fail(4, "qw", fmt::format("|q| = {:.6g}, a unit quaternion is wanted", norm(q)));
        samples.push_back({v[0], {{v[1], v[2], v[3]}, normalized(q)}});
    });
    if (samples.empty()) throw ConfigError(fmt::format("{}: no rows after the header", file.string()));
    return trajectory;
}

std::vector<scene::Joint::Sample> read_joint_table(const std::filesystem::path& file, std::string_view value,
                                                   double unit) {
    std::vector<scene::Joint::Sample> samples;
    config::read_csv(file, fmt::format("time_s,{}", value), [&](const config::CsvRow& row) {
        if (!samples.empty() && row.values[0] <= samples.back().time_s)
            row.fail(0, "time_s",
                     fmt::format("{} does not come after {}", row.values[0], samples.back().time_s));
        samples.push_back({row.values[0], row.values[1] * unit});
    });
    if (samples.empty()) throw ConfigError(fmt::format("{}: no rows after the header", file.string()));
    return samples;
}

} // namespace obscura::scene
