// SPDX-License-Identifier: Apache-2.0
#include "renderer/integrators/star_rows.hpp"

#include "core/solar_spectrum.hpp"
#include "renderer/scene/kernel_frame.hpp"
#include "renderer/world/kinematics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace obscura::renderer {
namespace {

/// Rows that are not divided further.
constexpr std::size_t min_rows = 16;
/// Reserve of the cone for which stars are looked up, so that the next blocks and frames find them there.
constexpr double spare_rad = 0.01;
/// Reserve for motions and parallaxes until the observer has moved by so much, and for the deflection of
/// light by the Sun.
constexpr double spare_shift_rad = 3e-5, spare_years = 0.1, spare_au = 1;

double angle_between(const Quat& a, const Quat& b) {
    // From the difference of the quaternions: accurate for the smallest angles.
    const double sign = dot(a, b) < 0 ? -1 : 1;
    const Quat d{a.w - sign * b.w, a.x - sign * b.x, a.y - sign * b.y, a.z - sign * b.z};
    return 4 * std::asin(std::min(1.0, norm(d) / 2));
}

double angle_between(Vec3 a, Vec3 b) {
    return std::atan2(length(cross(a, b)), dot(a, b));
}

} // namespace

StarObserver star_observer(const scene::Scene& scene, Vec3 camera_m, double time_s) {
    StarObserver observer;
    const Vec3 sun_m = scene.sun.position_at(time_s);
    if (scene.light_deflection) observer.sun_m = sun_m - camera_m;
    if (!scene.epoch) return observer;
    // J2000.0 is 12 h TT, and TT - TAI is 32.184 s. TDB differs from TT by 2 ms at most.
    constexpr double j2000_tai_s = 946'728'000 - 32.184, year_s = 365.25 * 86400;
    const double since_s = static_cast<double>(scene.epoch->tai_ns) * 1e-9 - j2000_tai_s + time_s;
    observer.years = since_s / year_s;
    observer.position_au =
        (camera_m - (scene.kernels ? scene.kernels->barycentre_m() : sun_m)) / astronomical_unit_m;
    return observer;
}

/// What split() needs of the whole block.
struct StarRows::Block {
    Region window;
    std::int32_t first_y;
    bool one_line;
    double aberration_rad;
    StarObserver observer;

    [[nodiscard]] double y(std::size_t row) const {
        return first_y + (one_line ? 0 : static_cast<double>(row));
    }
};

void StarRows::find(std::span<const RowTime> rows, StarsInView& view) const {
    view.poses.clear();
    if (field_.empty() || rows.empty()) {
        view.stars.clear();
        view.known = false;
        return;
    }
    const auto attitude = [&](Time t) { return camera_pose(scene_, bodies_, to_seconds(t.ns)).orientation; };
    double aberration_rad = 0;
    const RowTime* before = nullptr;
    for (const RowTime& t : rows) {
        if (before != nullptr && *before == t) { // a global shutter has one time for all rows
            view.poses.push_back(view.poses.back());
            continue;
        }
        before = &t;
        StarsInView::RowPose pose{attitude(t.mid())};
        if (t.exposure_ns() > 0)
            for (const Time edge : {t.reset, t.read})
                pose.turn_rad = std::max(pose.turn_rad, angle_between(pose.attitude, attitude(edge)));
        if (scene_.camera.vibration)
            pose.turn_rad += scene_.camera.vibration->path_rad(to_seconds(t.reset.ns), to_seconds(t.read.ns));
        view.poses.push_back(pose);
        if (scene_.aberration)
            aberration_rad =
                std::max(aberration_rad, 2 * length(camera_beta(scene_, bodies_, to_seconds(t.mid().ns))));
    }
    // Take the field at the middle row, grown by the largest turn of the camera within the rows.
    const Quat middle = view.poses[rows.size() / 2].attitude;
    double turn_rad = 0;
    for (const StarsInView::RowPose& pose : view.poses)
        turn_rad = std::max(turn_rad, angle_between(middle, pose.attitude) + pose.turn_rad);
    const double time_s = to_seconds(rows[rows.size() / 2].mid().ns);
    const Vec3 position_m = camera_pose(scene_, bodies_, time_s).position_m;
    find({position_m, middle}, turn_rad + aberration_rad, time_s, view);
}

void StarRows::find(const Pose& camera, double more_rad, double time_s, StarsInView& view) const {
    if (field_.empty()) {
        view.stars.clear();
        view.known = false;
        return;
    }
    const ephemeris::SkyCells::Cone cone{rotate(camera.orientation, {0, 0, 1}),
                                         lens_.field_angle_rad(reach_px_ + 1) + more_rad + 1e-9};
    const StarObserver observer = star_observer(scene_, camera.position_m, time_s);
    if (view.known && std::abs(observer.years - view.observer.years) < spare_years &&
        length(observer.position_au - view.observer.position_au) < spare_au &&
        angle_between(cone.axis, view.cone.axis) + cone.half_angle_rad < view.cone.half_angle_rad)
        return;
    view.known = true;
    view.observer = observer;
    view.cone = {cone.axis, cone.half_angle_rad + spare_rad};
    field_.inside(view.cone.axis, view.cone.half_angle_rad + spare_shift_rad, observer, view.stars);
}

void StarRows::assign(std::span<const RowTime> rows, const Region& window, std::int32_t first_y,
                      bool one_line, StarsInView& view) const {
    find(rows, view);
    view.first.clear();
    view.of_rows.clear();
    view.near.clear();
    view.first.push_back(0);
    if (view.poses.empty()) {
        view.first.resize(rows.size() + 1, 0);
        return;
    }
    constexpr double all = std::numeric_limits<double>::infinity();
    for (std::uint32_t i = 0; i < view.stars.numbers.size(); ++i)
        view.near.push_back({i, -all, all});
    Block block{window, first_y, one_line, 0, view.observer};
    if (scene_.aberration)
        for (const RowTime& t : {rows.front(), rows.back()})
            block.aberration_rad = std::max(block.aberration_rad,
                                            3 * length(camera_beta(scene_, bodies_, to_seconds(t.mid().ns))));
    split(block, 0, rows.size(), 0, view);
}

/// Assigns the stars view.near[first_near..] to the rows.
void StarRows::split(const Block& block, std::size_t first_row, std::size_t end_row, std::size_t first_near,
                     StarsInView& view) const {
    const Quat middle = view.poses[first_row + (end_row - first_row) / 2].attitude;
    double turn_rad = 0;
    for (std::size_t r = first_row; r < end_row; ++r)
        turn_rad = std::max(turn_rad, angle_between(middle, view.poses[r].attitude) + view.poses[r].turn_rad);
    const Mat3 camera_from_inertial = transposed(to_matrix(middle));
    const double first_y = block.y(first_row);
    const double last_y = block.y(end_row - 1);
    const double first_x = block.window.x, last_x = first_x + block.window.width - 1;
    const std::size_t end_near = view.near.size();
    bool close = true; // the rows of each star are known to a few
    for (std::size_t i = first_near; i < end_near; ++i) {
        StarsInView::Near near = view.near[i];
        const Vec3 towards = camera_from_inertial * view.stars.places[near.star].from(block.observer);
        const double shift_rad = turn_rad + block.aberration_rad + spare_shift_rad;
        // Farther away the scale of the lens may be another one; the camera sees the star in any row then.
        constexpr double max_shift_rad = 0.05;
        const auto at = shift_rad < max_shift_rad ? lens_.project(towards) : std::nullopt;
        if (at) {
            const double reach = reach_px_ + 1 + 1.5 * shift_rad / lens_.local_pixel_angle_rad(towards);
            near.from_y = at->y - reach;
            near.to_y = at->y + reach;
            if (near.from_y > last_y || near.to_y < first_y || at->x + reach < first_x ||
                at->x - reach > last_x)
                continue;
            close = close && reach < reach_px_ + 8;
        } else {
            close = false;
        }
        view.near.push_back(near);
    }
    if (close || end_row - first_row <= min_rows) {
        for (std::size_t r = first_row; r < end_row; ++r) {
            const double y = block.y(r);
            for (std::size_t i = end_near; i < view.near.size(); ++i)
                if (view.near[i].from_y <= y && view.near[i].to_y >= y)
                    view.of_rows.push_back(view.near[i].star);
            view.first.push_back(static_cast<std::uint32_t>(view.of_rows.size()));
        }
    } else {
        const std::size_t middle_row = first_row + (end_row - first_row) / 2;
        split(block, first_row, middle_row, end_near, view);
        split(block, middle_row, end_row, end_near, view);
    }
    view.near.resize(end_near);
}

} // namespace obscura::renderer
