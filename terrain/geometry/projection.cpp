// SPDX-License-Identifier: Apache-2.0
#include "terrain/geometry/projection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace obscura::terrain {
namespace {

using std::numbers::pi;

double wrapped(double angle_rad) {
    return std::remainder(angle_rad, 2 * pi);
}

/// The latitude, positive towards the pole of the map.
double towards_pole(ProjectionKind kind, double latitude_rad) {
    return kind == ProjectionKind::south_polar_stereographic ? -latitude_rad : latitude_rad;
}

/// t of Snyder (15-9): tan(colatitude / 2) of the conformal latitude.
double conformal_t(double latitude_rad, double e) {
    const double es = e * std::sin(latitude_rad);
    return std::tan(pi / 4 - latitude_rad / 2) / std::pow((1 - es) / (1 + es), e / 2);
}

/// m of Snyder (14-15): radius of the parallel over the equatorial radius.
double parallel_radius(double latitude_rad, double e) {
    const double es = e * std::sin(latitude_rad);
    return std::cos(latitude_rad) / std::sqrt(1 - es * es);
}

} // namespace

Projection Projection::of_sphere(ProjectionKind kind, double radius_m, double centre_longitude_rad) {
    Projection p;
    p.kind = kind;
    p.equatorial_radius_m = p.polar_radius_m = radius_m;
    p.centre_longitude_rad = centre_longitude_rad;
    if (kind == ProjectionKind::north_polar_stereographic) p.true_scale_latitude_rad = pi / 2;
    if (kind == ProjectionKind::south_polar_stereographic) p.true_scale_latitude_rad = -pi / 2;
    return p;
}

double Projection::eccentricity() const {
    const double ratio = polar_radius_m / equatorial_radius_m;
    return spheroid() ? std::sqrt(std::fmax(0, 1 - ratio * ratio)) : 0;
}

double Projection::longitude_rad(Vec3 p) const {
    return std::atan2(p.y, p.x);
}

double Projection::latitude_rad(Vec3 p) const {
    const double flat = spheroid() ? equatorial_radius_m / polar_radius_m : 1;
    return std::atan2(p.z * flat * flat, std::hypot(p.x, p.y));
}

double Projection::polar_distance_m(double latitude_rad) const {
    const double e = eccentricity();
    const double true_scale = towards_pole(kind, true_scale_latitude_rad);
    const double t = conformal_t(towards_pole(kind, latitude_rad), e);
    // Snyder (21-33), (21-34): at the pole m_c / t_c has the limit of the first form.
    if (pi / 2 - true_scale < 1e-9)
        return 2 * equatorial_radius_m * t / std::sqrt(std::pow(1 + e, 1 + e) * std::pow(1 - e, 1 - e));
    return equatorial_radius_m * parallel_radius(true_scale, e) / conformal_t(true_scale, e) * t;
}

MapPoint Projection::forward(Vec3 p) const {
    if (kind == ProjectionKind::planar) return {p.x, p.y};
    const double longitude = longitude_rad(p) - centre_longitude_rad;
    const double latitude = latitude_rad(p);
    if (kind == ProjectionKind::simple_cylindrical)
        return {equatorial_radius_m * std::cos(true_scale_latitude_rad) * wrapped(longitude),
                equatorial_radius_m * latitude};
    const double rho = polar_distance_m(latitude);
    const double along = kind == ProjectionKind::north_polar_stereographic ? -rho : rho;
    return {rho * std::sin(longitude), along * std::cos(longitude)};
}

Vec3 Projection::inverse(MapPoint at) const {
    if (kind == ProjectionKind::planar) return {at.x_m, at.y_m, 0};
    double longitude = 0, latitude = 0;
    if (kind == ProjectionKind::simple_cylindrical) {
        longitude = at.x_m / (equatorial_radius_m * std::cos(true_scale_latitude_rad));
        latitude = at.y_m / equatorial_radius_m;
    } else {
        const double along = kind == ProjectionKind::north_polar_stereographic ? -at.y_m : at.y_m;
        longitude = std::atan2(at.x_m, along);
        // t is proportional to rho; the conformal latitude, then Snyder (7-9).
        const double e = eccentricity();
        const double t = std::hypot(at.x_m, at.y_m) / polar_distance_m(0) * conformal_t(0, e);
        double phi = pi / 2 - 2 * std::atan(t);
        for (int k = 0; e > 0 && k < 30; ++k) {
            const double es = e * std::sin(phi);
            const double next = pi / 2 - 2 * std::atan(t * std::pow((1 - es) / (1 + es), e / 2));
            const bool done = std::abs(next - phi) < 1e-16;
            phi = next;
            if (done) break;
        }
        latitude = towards_pole(kind, phi);
    }
    longitude += centre_longitude_rad;
    if (spheroid()) { // to the direction from the centre
        const double flat = polar_radius_m / equatorial_radius_m;
        latitude = std::atan2(std::sin(latitude) * flat * flat, std::cos(latitude));
    }
    return {std::cos(latitude) * std::cos(longitude), std::cos(latitude) * std::sin(longitude),
            std::sin(latitude)};
}

double Projection::turn_m() const {
    if (kind != ProjectionKind::simple_cylindrical) return 0;
    return 2 * pi * equatorial_radius_m * std::cos(true_scale_latitude_rad);
}

MapPoint Projection::metres_per_radian(Vec3 p) const {
    if (kind == ProjectionKind::planar) return {1, 1};
    const double across = std::hypot(p.x, p.y);
    const double r = std::sqrt(across * across + p.z * p.z);
    if (kind == ProjectionKind::simple_cylindrical)
        return {across > 0 ? equatorial_radius_m * std::cos(true_scale_latitude_rad) * r / across
                           : std::numeric_limits<double>::infinity(),
                equatorial_radius_m};
    // Conformal: along the meridian as along the parallel, of length cos(latitude).
    const double latitude = latitude_rad(p);
    const double colatitude = pi / 2 - towards_pole(kind, latitude);
    const double scale =
        colatitude < 1e-7 ? polar_distance_m(0) / 2 : polar_distance_m(latitude) / (across / r);
    return {scale, scale};
}

MapPoint Projection::step(Vec3 p, Vec3 step_m) const {
    if (kind == ProjectionKind::planar) return {step_m.x, step_m.y};
    const double r = length(p);
    const double across = std::max(std::hypot(p.x, p.y), 1e-9 * r);
    const Vec3 out = across > 1e-9 * r ? Vec3{p.x / across, p.y / across, 0} : Vec3{1, 0, 0};
    const double sine = p.z / r, cosine = across / r;
    const double east = (out.x * step_m.y - out.y * step_m.x) / r; // radians of arc
    const double north = (cosine * step_m.z - sine * (out.x * step_m.x + out.y * step_m.y)) / r;
    const MapPoint scale = metres_per_radian(p);
    if (kind == ProjectionKind::simple_cylindrical) {
        // Planetographic latitudes grow at another rate than the direction's.
        const double flat = spheroid() ? equatorial_radius_m / polar_radius_m : 1;
        const double rate = flat * flat / (cosine * cosine + flat * flat * flat * flat * sine * sine);
        return {equatorial_radius_m * std::cos(true_scale_latitude_rad) * east / cosine,
                scale.y_m * rate * north};
    }
    const double longitude = std::atan2(out.y, out.x) - centre_longitude_rad;
    const double sign = kind == ProjectionKind::north_polar_stereographic ? -1 : 1;
    const double away = sign * north; // from the pole
    const double x = away * std::sin(longitude) + east * std::cos(longitude);
    const double y = away * std::cos(longitude) - east * std::sin(longitude);
    return {scale.x_m * x, scale.x_m * sign * y};
}

} // namespace obscura::terrain
