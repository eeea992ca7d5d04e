// SPDX-License-Identifier: Apache-2.0
#include "models/kinds/shape_checks.hpp"

#include "core/philox.hpp"
#include "core/units.hpp"
#include "models/kinds/shape_march.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::models {
namespace {

constexpr std::uint32_t packets_of_rays = 256;
constexpr double thin_share = 1e-3; ///< of the radius

Vec3 random_direction(double u, double v) {
    const double z = 2 * u - 1, r = std::sqrt(std::max(0.0, 1 - z * z)), a = 2 * std::numbers::pi * v;
    return {r * std::cos(a), r * std::sin(a), z};
}

/// Rays from one point of the ball's surface to another: uniform over chords by their ends.
ShapeRays random_rays(std::uint32_t packet, double radius_m) {
    ShapeRays rays;
    for (std::uint32_t i = 0; i < shape_lanes; ++i) {
        const auto w = philox4x32({i, packet, 0, 0x736870}, philox_key(5));
        const Vec3 from = random_direction(uniform_double(w[0]), uniform_double(w[1]));
        const Vec3 to = random_direction(uniform_double(w[2]), uniform_double(w[3]));
        rays.origin[i] = 2 * radius_m * from;
        rays.direction[i] = normalized(radius_m * to - rays.origin[i]);
        rays.t_max[i] = 8 * radius_m;
    }
    return rays;
}

/// Values and gradients at 16 points.
struct ShapeValues {
    std::array<double, shape_lanes> value{};
    std::array<Vec3, shape_lanes> gradient{};
};
ShapeValues values_at(const ShapeProgram& shape, const std::array<Vec3, shape_lanes>& points) {
    std::array<std::array<double, shape_lanes>, 3> place{};
    std::array<std::array<double, shape_lanes>, 4> rows{};
    for (std::size_t i = 0; i < shape_lanes; ++i) {
        place[0][i] = points[i].x;
        place[1][i] = points[i].y;
        place[2][i] = points[i].z;
    }
    shape.run({place[0].data(), place[1].data(), place[2].data()},
              {rows[0].data(), rows[1].data(), rows[2].data(), rows[3].data()}, shape_lanes);
    ShapeValues values;
    values.value = rows[0];
    for (std::size_t i = 0; i < shape_lanes; ++i)
        values.gradient[i] = {rows[1][i], rows[2][i], rows[3][i]};
    return values;
}

/// Notes values on the sphere that bounds the shape.
void look_at_bound(const ShapeProgram& shape, ShapeReport& report) {
    std::uint32_t cut = 0;
    for (std::uint32_t packet = 0; packet < packets_of_rays; ++packet) {
        std::array<Vec3, shape_lanes> points;
        for (std::uint32_t i = 0; i < shape_lanes; ++i) {
            const auto w = philox4x32({i, packet, 1, 0x736870}, philox_key(5));
            points[i] =
                shape.bounding_radius_m() * random_direction(uniform_double(w[0]), uniform_double(w[1]));
        }
        const ShapeValues found = values_at(shape, points);
        for (std::size_t i = 0; i < shape_lanes; ++i) {
            if (!(found.value[i] <= 0)) continue;
            if (cut++ > 0) continue;
            report.cut_longitude_deg = std::atan2(points[i].y, points[i].x) / degree;
            report.cut_latitude_deg = std::asin(points[i].z / length(points[i])) / degree;
        }
    }
    report.cut_share = cut / (16.0 * packets_of_rays);
}

/// Notes the way through the body, straight in from where rays have hit it.
void look_through(const ShapeProgram& shape, const ShapeRays& rays, const ShapeHits& hits,
                  ShapeReport& report) {
    std::array<Vec3, shape_lanes> points{};
    for (std::size_t i = 0; i < shape_lanes; ++i)
        if (std::isfinite(hits.t[i])) points[i] = rays.origin[i] + hits.t[i] * rays.direction[i];
    const ShapeValues found = values_at(shape, points);
    ShapeRays inwards;
    constexpr double below = 1e-6; // of the radius
    for (std::size_t i = 0; i < shape_lanes; ++i) {
        const double slope = length(found.gradient[i]);
        if (!std::isfinite(hits.t[i]) || !(slope > 0) || !std::isfinite(slope)) continue;
        report.largest_m = std::max(report.largest_m, length(points[i]));
        report.worst_slope = std::max(report.worst_slope, slope);
        inwards.direction[i] = found.gradient[i] / -slope;
        inwards.origin[i] = points[i] + below * shape.bounding_radius_m() * inwards.direction[i];
        inwards.t_max[i] = 8 * shape.bounding_radius_m();
    }
    ShapeHits through;
    trace(shape, inwards, through);
    for (std::size_t i = 0; i < shape_lanes; ++i) {
        if (!(inwards.t_max[i] > 0)) continue;
        const double thick = std::isfinite(through.t[i]) ? through.t[i] + below * shape.bounding_radius_m()
                                                         : 2 * shape.bounding_radius_m();
        if (report.thinnest_m == 0 || thick < report.thinnest_m) {
            report.thinnest_m = thick;
            report.thinnest_at = points[i];
        }
    }
}

std::string place_text(Vec3 p) {
    return fmt::format("({:.6g}, {:.6g}, {:.6g}) m", p.x, p.y, p.z);
}

} // namespace

ShapeReport report_on(const ShapeProgram& shape) {
    ShapeReport report;
    look_at_bound(shape, report);
    std::uint32_t hit = 0, doubtful = 0, evaluations = 0;
    for (std::uint32_t packet = 0; packet < packets_of_rays; ++packet) {
        const ShapeRays rays = random_rays(packet, shape.bounding_radius_m());
        ShapeHits hits;
        trace(shape, rays, hits);
        evaluations += hits.evaluations;
        for (std::size_t i = 0; i < shape_lanes; ++i) {
            if (std::isfinite(hits.t[i])) ++hit;
            if (!hits.doubtful[i]) continue;
            const double along = -dot(rays.origin[i], rays.direction[i]);
            if (doubtful++ == 0)
                report.doubtful_at =
                    rays.origin[i] + (std::isfinite(hits.t[i]) ? hits.t[i] : along) * rays.direction[i];
        }
        look_through(shape, rays, hits, report);
    }
    const double rays = 16.0 * packets_of_rays;
    report.hit_share = hit / rays;
    report.doubtful_share = doubtful / rays;
    report.evaluations_a_ray = evaluations / double{packets_of_rays};
    report.inside_everywhere = report.cut_share == 1;
    return report;
}

std::string refusal_by(const ShapeReport& report, const ShapeProgram& shape) {
    const double r = shape.bounding_radius_m();
    if (report.inside_everywhere)
        return fmt::format("{}() is positive nowhere at the bound of {:.6g} m: all is inside",
                           shape.function(), r);
    if (report.hit_share == 0)
        return fmt::format("{}() has no sign change within the bound of {:.6g} m: there is no surface",
                           shape.function(), r);
    return "";
}

std::vector<std::string> warnings_by(const ShapeReport& report, const ShapeProgram& shape) {
    std::vector<std::string> lines;
    const double r = shape.bounding_radius_m();
    if (report.cut_share > 0)
        lines.push_back(
            fmt::format("the surface leaves the bound of {:.6g} m, where it is cut: {:.2g} % of it, at "
                        "longitude {:.0f} and latitude {:.0f} deg",
                        r, 100 * report.cut_share, report.cut_longitude_deg, report.cut_latitude_deg));
    if (report.thinnest_m > 0 && report.thinnest_m < thin_share * r)
        lines.push_back(
            fmt::format("a part is only {:.3g} m thick at {}, less than 0.001 of the bound: rays may "
                        "take it for none",
                        report.thinnest_m, place_text(report.thinnest_at)));
    if (report.doubtful_share == 0) return lines;
    if (shape.claimed_slope() > 0)
        lines.push_back(fmt::format(
            "{:.2g} % of the rays are not sure: the slope exceeds the property lipschitz of {:g}, or the steps ran "
            "out, first at {}; the largest slope at the surface is {:.4g}",
            100 * report.doubtful_share, shape.claimed_slope(), place_text(report.doubtful_at),
            report.worst_slope));
    else
        lines.push_back(
            fmt::format("{:.2g} % of the rays are not sure, first at {}: the value jumps, is not a "
                        "number, or the steps ran out",
                        100 * report.doubtful_share, place_text(report.doubtful_at)));
    return lines;
}

} // namespace obscura::models
