// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene/surface_place.hpp"

#include "renderer/scene/central_difference.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace obscura::scene {
namespace {

/// Direction at the share `s` of the way along the great circle from `a` to `b`.
Vec3 along_great_circle(Vec3 a, Vec3 b, double s) {
    const double angle = std::atan2(length(cross(a, b)), dot(a, b));
    if (!(angle > 0)) return a;
    Vec3 axis = cross(a, b), other;
    // Opposite points: any great circle is as good.
    if (!(length(axis) > 1e-12)) orthonormal_basis(a, axis, other);
    return normalized(rotate(axis_angle(axis, s * angle), a));
}

class SurfacePath final : public PosePath {
public:
    SurfacePath(SurfaceTrack track, Vec3 radii_m, std::shared_ptr<const PosePath> attitudes)
        : track_(std::move(track)), radii_m_(radii_m), attitudes_(std::move(attitudes)) {}

    [[nodiscard]] Pose at(double time_s) const noexcept override {
        const auto& all = track_.places;
        const auto after =
            std::upper_bound(all.begin(), all.end(), time_s,
                             [](double t, const SurfacePlace& place) { return t < place.time_s; });
        const SurfacePlace& first = after == all.begin() ? all.front() : *(after - 1);
        const SurfacePlace& second = after == all.end() ? all.back() : *after;
        Vec3 up = direction_of(first.longitude_rad, first.latitude_rad);
        double longitude_rad = first.longitude_rad, height_m = first.height_m;
        if (second.time_s > first.time_s) {
            const double share = (time_s - first.time_s) / (second.time_s - first.time_s);
            up = along_great_circle(up, direction_of(second.longitude_rad, second.latitude_rad), share);
            height_m += share * (second.height_m - first.height_m);
            if (share > 0) longitude_rad = std::atan2(up.y, up.x);
        }
        const HeightLine line = height_line(up, track_.latitudes, radii_m_);
        Pose pose{line.foot_m + height_m * line.up, attitudes_->at(time_s).orientation};
        if (track_.axes == PlaceAxes::east_north_up)
            pose.orientation = east_north_up(longitude_rad, up) * pose.orientation;
        return pose;
    }
    [[nodiscard]] Vec3 velocity_m_s(double time_s) const noexcept override {
        const auto& all = track_.places;
        if (all.size() == 1 || time_s < all.front().time_s || time_s > all.back().time_s) return {};
        // Within the rows, so that an end does not halve the velocity.
        const double inside_s = all.back().time_s - all.front().time_s < 0.2
                                    ? (all.front().time_s + all.back().time_s) / 2
                                    : std::clamp(time_s, all.front().time_s + 0.1, all.back().time_s - 0.1);
        return differenced_velocity_m_s([this](double t) { return at(t).position_m; }, inside_s);
    }
    [[nodiscard]] PoseAges ages(double time_s) const noexcept override {
        const auto& all = track_.places;
        PoseAges ages = attitudes_->ages(time_s);
        ages.position_s =
            all.size() == 1 ? 0 : std::max({0.0, all.front().time_s - time_s, time_s - all.back().time_s});
        return ages;
    }
    [[nodiscard]] std::vector<double> times_s() const override {
        std::vector<double> times = attitudes_->times_s();
        if (track_.places.size() > 1)
            for (const SurfacePlace& place : track_.places)
                times.push_back(place.time_s);
        std::sort(times.begin(), times.end());
        times.erase(std::unique(times.begin(), times.end()), times.end());
        return times;
    }
    [[nodiscard]] std::vector<double> attitude_instants_s() const override {
        return attitudes_->attitude_instants_s();
    }

private:
    SurfaceTrack track_;
    Vec3 radii_m_;
    std::shared_ptr<const PosePath> attitudes_;
};

} // namespace

Vec3 direction_of(double longitude_rad, double latitude_rad) {
    const double c = std::cos(latitude_rad);
    return {c * std::cos(longitude_rad), c * std::sin(longitude_rad), std::sin(latitude_rad)};
}

HeightLine height_line(Vec3 up, Latitudes latitudes, Vec3 radii_m) {
    if (!(length(radii_m) > 0)) return {{}, up};
    const Vec3 a = radii_m;
    if (latitudes == Latitudes::planetocentric) {
        const double r =
            1 / std::sqrt(up.x * up.x / (a.x * a.x) + up.y * up.y / (a.y * a.y) + up.z * up.z / (a.z * a.z));
        return {r * up, up};
    }
    // The point of the ellipsoid of which `up` is the outer normal.
    const Vec3 squared{a.x * a.x * up.x, a.y * a.y * up.y, a.z * a.z * up.z};
    return {squared / std::sqrt(dot(squared, up)), up};
}

Quat east_north_up(double longitude_rad, Vec3 up) {
    const Vec3 east{-std::sin(longitude_rad), std::cos(longitude_rad), 0};
    const Vec3 north = cross(up, east);
    return from_matrix({{{east.x, north.x, up.x}, {east.y, north.y, up.y}, {east.z, north.z, up.z}}});
}

std::shared_ptr<const PosePath> surface_path(SurfaceTrack track, Vec3 radii_m,
                                             std::shared_ptr<const PosePath> attitudes) {
    return std::make_shared<const SurfacePath>(std::move(track), radii_m, std::move(attitudes));
}

} // namespace obscura::scene
