// SPDX-License-Identifier: Apache-2.0
#include "models/kinds/projection_checks.hpp"

#include "core/units.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

namespace obscura::models {
namespace {

constexpr std::size_t points_per_side = 33;
constexpr std::size_t sphere_directions = 16'384;
constexpr double infinite = std::numeric_limits<double>::infinity();

std::size_t whole_packets(std::size_t count) {
    return (count + Program::lane_step - 1) / Program::lane_step * Program::lane_step;
}

/// Image points with their directions, an array for each component.
struct CheckedRays {
    std::size_t count;
    std::vector<double> x, y, dx, dy, dz, solid_angle;

    explicit CheckedRays(std::size_t points)
        : count(points), x(whole_packets(points)), y(x), dx(x), dy(x), dz(x.size(), 1), solid_angle(x) {}
    void find_directions(const ProjectionProgram& projection) {
        projection.rays(x.data(), y.data(), {dx.data(), dy.data(), dz.data()}, solid_angle.data(), x.size());
    }
    [[nodiscard]] DirectionRows directions() const { return {dx.data(), dy.data(), dz.data()}; }
    [[nodiscard]] CheckedPoint point(std::size_t i) const { return {x[i], y[i]}; }
    [[nodiscard]] bool sees(std::size_t i) const { return solid_angle[i] != 0; }
    [[nodiscard]] double angle_deg(std::size_t i) const {
        return std::atan2(std::hypot(dx[i], dy[i]), dz[i]) / degree;
    }
};

CheckedRays sensor_grid(const ProjectionProgram& projection) {
    CheckedRays grid(points_per_side * points_per_side);
    const SensorPlane& plane = projection.plane();
    for (std::size_t i = 0; i < grid.count; ++i) {
        const auto column = static_cast<double>(i % points_per_side);
        const auto row = static_cast<double>(i / points_per_side);
        grid.x[i] = -0.5 + plane.width * column / (points_per_side - 1);
        grid.y[i] = -0.5 + plane.height * row / (points_per_side - 1);
    }
    grid.find_directions(projection);
    return grid;
}

/// Directions and back: the round trip of the grid's points, folds, and holes.
void check_grid(const ProjectionProgram& projection, const CheckedRays& grid, ProjectionReport& report) {
    std::vector<double> x(grid.x.size()), y(x), fraction(x);
    projection.project(grid.directions(), x.data(), y.data(), x.size());
    projection.transmission(grid.directions(), fraction.data(), x.size());
    int orientation = 0;
    for (std::size_t i = 0; i < grid.count; ++i) {
        if (!grid.sees(i)) {
            bool inside = i % points_per_side > 0 && i % points_per_side < points_per_side - 1 &&
                          i >= points_per_side && i + points_per_side < grid.count;
            for (const std::size_t step : {std::size_t{1}, points_per_side})
                inside = inside && grid.sees(i - step) && grid.sees(i + step);
            if (!inside) continue;
            if (report.hole_share == 0) report.hole_at = grid.point(i);
            report.hole_share += 1.0 / static_cast<double>(grid.count);
            continue;
        }
        report.seen_share += 1.0 / static_cast<double>(grid.count);
        report.field_deg = std::max(report.field_deg, grid.angle_deg(i));
        const int side = grid.solid_angle[i] > 0 ? 1 : -1;
        if (orientation == 0) orientation = side;
        if (side != orientation && !report.folded) {
            report.folded = true;
            report.folded_at = grid.point(i);
        }
        const double distance = std::hypot(x[i] - grid.x[i], y[i] - grid.y[i]);
        const double told = std::isfinite(distance) ? distance : infinite;
        if (told > report.round_trip_px) {
            report.round_trip_px = told;
            report.round_trip_at = grid.point(i);
        }
        if (!(fraction[i] >= 0 && fraction[i] <= 1) && report.transmission_valid) {
            report.transmission_valid = false;
            report.transmission = fraction[i];
            report.transmission_at = grid.point(i);
        }
    }
    report.mirrored = orientation < 0;
}

/// Directions all round, evenly, and half of them within the field.
CheckedRays directions_to_check(const ProjectionProgram& projection) {
    CheckedRays rays(2 * sphere_directions);
    const std::array<double, 3> axis = projection.axis();
    const std::array<double, 3> helper =
        std::fabs(axis[0]) < 0.9 ? std::array<double, 3>{1, 0, 0} : std::array<double, 3>{0, 1, 0};
    std::array<double, 3> a{axis[1] * helper[2] - axis[2] * helper[1],
                            axis[2] * helper[0] - axis[0] * helper[2],
                            axis[0] * helper[1] - axis[1] * helper[0]};
    const double length = std::hypot(a[0], a[1], a[2]);
    for (double& component : a)
        component /= length;
    const std::array<double, 3> b{axis[1] * a[2] - axis[2] * a[1], axis[2] * a[0] - axis[0] * a[2],
                                  axis[0] * a[1] - axis[1] * a[0]};
    const double cap = 1 - projection.min_cosine();
    for (std::size_t i = 0; i < rays.count; ++i) {
        const double share = (static_cast<double>(i % sphere_directions) + 0.5) / sphere_directions;
        const double rest = share * (i < sphere_directions ? cap : 2); // 1 - cos, exact for narrow fields
        const double radius = std::sqrt(rest * (2 - rest));
        const double azimuth = static_cast<double>(i) * std::numbers::pi * (3 - std::sqrt(5.0));
        const double u = radius * std::cos(azimuth), v = radius * std::sin(azimuth);
        rays.dx[i] = axis[0] * (1 - rest) + a[0] * u + b[0] * v;
        rays.dy[i] = axis[1] * (1 - rest) + a[1] * u + b[1] * v;
        rays.dz[i] = axis[2] * (1 - rest) + a[2] * u + b[2] * v;
    }
    return rays;
}

/// Whether a point of the sensor has two directions. Those outside of the field count where the field does
/// not fill the sensor: it may end where the projection folds.
void check_directions(const ProjectionProgram& projection, bool fills, ProjectionReport& report) {
    CheckedRays sent = directions_to_check(projection);
    CheckedRays back = sent;
    projection.project_any(sent.directions(), sent.x.data(), sent.y.data(), sent.x.size());
    back.x = sent.x;
    back.y = sent.y;
    back.find_directions(projection);
    std::size_t on_sensor = 0, twice = 0, lost = 0;
    const SensorPlane& plane = projection.plane();
    for (std::size_t i = 0; i < sent.count; ++i) {
        const double x = sent.x[i], y = sent.y[i];
        if (!(x >= -0.5 && x <= plane.width - 0.5 && y >= -0.5 && y <= plane.height - 0.5)) continue;
        const auto& axis = projection.axis();
        const double cosine = axis[0] * sent.dx[i] + axis[1] * sent.dy[i] + axis[2] * sent.dz[i];
        if (fills && cosine < projection.min_cosine()) continue;
        ++on_sensor;
        if (!back.sees(i)) {
            if (lost++ == 0) report.lost_at = {x, y};
            continue;
        }
        const double difference =
            std::hypot(sent.dx[i] - back.dx[i], sent.dy[i] - back.dy[i], sent.dz[i] - back.dz[i]);
        // A pixel is some root of its solid angle wide.
        if (difference < 1e-3 * std::sqrt(std::fabs(back.solid_angle[i])) + 1e-12) continue;
        if (twice++ == 0) {
            report.ambiguous_at = {x, y};
            report.ambiguous_deg = {back.angle_deg(i), sent.angle_deg(i)};
        }
    }
    if (on_sensor == 0) return;
    report.ambiguous_share = static_cast<double>(twice) / static_cast<double>(on_sensor);
    report.lost_share = static_cast<double>(lost) / static_cast<double>(on_sensor);
}

std::string text_of(CheckedPoint p) {
    return fmt::format("at pixel ({:.0f}, {:.0f})", p.x, p.y);
}

} // namespace

ProjectionReport report_on(const ProjectionProgram& projection) {
    ProjectionReport report;
    if (projection.is_blind()) return report;
    const CheckedRays grid = sensor_grid(projection);
    check_grid(projection, grid, report);
    const bool fills = report.seen_share > 1 - 0.5 / static_cast<double>(grid.count);
    check_directions(projection, fills, report);
    return report;
}

std::string refusal_by(const ProjectionReport& report) {
    if (report.seen_share == 0)
        return "no direction falls on the sensor: see the unit of lengths, which is m";
    if (report.folded)
        return fmt::format("the projection is not one to one: its image is mirrored {}, and not before",
                           text_of(report.folded_at));
    if (report.round_trip_px > 1e-6)
        return std::isfinite(report.round_trip_px)
                   ? fmt::format("ray() and point() differ by {:.3g} px {}: allowed is 1e-6",
                                 report.round_trip_px, text_of(report.round_trip_at))
                   : fmt::format("what is seen {} has no image point", text_of(report.round_trip_at));
    if (report.ambiguous_share > 1e-3)
        return fmt::format(
            "the projection is not one to one: directions at {:.1f} and {:.1f} deg to the boresight "
            "fall both {}; let point() return vec2(M_NAN) for directions that are not seen",
            report.ambiguous_deg[0], report.ambiguous_deg[1], text_of(report.ambiguous_at));
    if (report.hole_share > 0)
        return fmt::format(
            "nothing is seen {}, but all round it: the projection or its derivative is not finite "
            "there",
            text_of(report.hole_at));
    if (report.lost_share > 0.1)
        return fmt::format("{:.0f} % of the directions on the sensor are not found again, such as that {}",
                           report.lost_share * 100, text_of(report.lost_at));
    if (!report.transmission_valid)
        return fmt::format("transmission() is {:.4g} {}: allowed is 0..1", report.transmission,
                           text_of(report.transmission_at));
    return "";
}

std::vector<std::string> warnings_by(const ProjectionReport& report) {
    std::vector<std::string> lines;
    if (report.field_deg > 90)
        lines.push_back(
            fmt::format("the field reaches {:.1f} deg from the boresight: more than a half of space is seen",
                        report.field_deg));
    if (report.mirrored) lines.push_back("the image is a mirrored one");
    if (report.lost_share > 0)
        lines.push_back(
            fmt::format("{:.2g} % of the directions on the sensor are not found again, such as that {}: "
                        "pixels there see nothing",
                        report.lost_share * 100, text_of(report.lost_at)));
    return lines;
}

} // namespace obscura::models
