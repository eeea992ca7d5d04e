// SPDX-License-Identifier: Apache-2.0
#include "renderer/reprojection/kept_image.hpp"

#include "renderer/camera/aberration.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace obscura::renderer {

void KeptView::set(const RowState& row) {
    camera_from_inertial = row.camera_from_inertial;
    beta = row.beta;
    bodies.resize(row.bodies.size());
    std::transform(row.bodies.begin(), row.bodies.end(), bodies.begin(), [](const BodyState& body) {
        return Body{body.from_camera, body.camera_m, body.sun_m};
    });
}

std::optional<ImagePoint> KeptView::project(const Projection& lens, Vec3 direction, double& weight_sr) const {
    const bool moving = length(beta) > 0;
    const std::optional<ImagePoint> at =
        moving ? MovingLens(lens, beta).project(direction) : lens.project(direction);
    if (at) weight_sr = lens.solid_angle_sr(at->x, at->y) * lens.transmission(direction);
    return at;
}

KeptView::Change KeptView::change_to(const RowState& row, const Projection& lens, double field_rad) const {
    Change change;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const BodyState& body = row.bodies[b];
        const Vec3 d = body.direction;
        const double off_rad = std::atan2(std::hypot(d.x, d.y), d.z);
        if (body.targeted || (body.cos_cone >= 0 && off_rad > field_rad + std::asin(body.cone_sine)))
            continue;
        const Body& then = bodies[b];
        const auto angle = [](Vec3 u, Vec3 v) { return std::atan2(length(cross(u, v)), dot(u, v)); };
        change.sun_rad = std::max(change.sun_rad, angle(then.sun_m, body.sun_m));
        // Points of the body turn about its centre, which moves too.
        const Vec3 centre_then = transposed(then.from_camera) * -then.camera_m;
        double shift_px = angle(centre_then, body.direction) / lens.pixel_angle_rad();
        if (const auto before = lens.project(centre_then), after = lens.project(body.direction);
            before && after)
            shift_px = std::hypot(after->x - before->x, after->y - before->y);
        double turn_rad = 0;
        for (const Vec3 axis : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}})
            turn_rad = std::max(
                turn_rad, angle(transposed(then.from_camera) * axis, transposed(body.from_camera) * axis));
        const double radius_px = body.cos_cone < 0 ? std::numeric_limits<double>::infinity()
                                                   : std::asin(body.cone_sine) / lens.pixel_angle_rad();
        const double turn_px = turn_rad > 0 ? turn_rad * radius_px : 0;
        change.motion_px = std::max(change.motion_px, shift_px + turn_px);
    }
    return change;
}

void KeptImage::begin(const Region& area, std::size_t channels, std::size_t bodies) {
    area_ = area;
    channels_ = channels;
    const auto rows = static_cast<std::size_t>(area.height);
    const std::size_t floats = channels * rows * static_cast<std::size_t>(area.width);
    if (light_.size() < floats) light_.resize(floats);
    if (lit_.size() < rows) lit_.resize(rows);
    if (views_.size() < rows / view_rows + 1) views_.resize(rows / view_rows + 1);
    for (KeptView& view : views_)
        view.bodies.reserve(bodies);
    kept_.assign(rows, 0);
}

void KeptImage::keep_row(std::int32_t y, std::span<const double> light) {
    const auto row = static_cast<std::size_t>(y - area_.y);
    const auto width = static_cast<std::size_t>(area_.width);
    const std::size_t plane_size = width * static_cast<std::size_t>(area_.height);
    LitColumns lit{area_.width, 0};
    for (std::size_t c = 0; c < channels_; ++c) {
        float* const out = light_.data() + c * plane_size + row * width;
        const double* const in = light.data() + c * width;
        std::int32_t first = 0;
        std::int32_t end = area_.width;
        while (first < end && !(in[first] > 0))
            ++first;
        while (end > first && !(in[end - 1] > 0))
            --end;
        lit.first = std::min(lit.first, first);
        lit.end = std::max(lit.end, end);
        std::transform(in, in + width, out, [](double v) { return static_cast<float>(v); });
    }
    lit_[row] = lit;
    kept_[row] = 1;
}

bool KeptImage::complete() const {
    return !kept_.empty() && std::find(kept_.begin(), kept_.end(), 0) == kept_.end();
}

KeptImage::Between KeptImage::views_about(double y) const {
    const std::int32_t last = (area_.height - 1) / view_rows;
    if (one_time_ || last == 0) return {views_.data(), views_.data(), 0};
    const double at = (y - area_.y) / view_rows;
    const std::int32_t first = std::clamp(static_cast<std::int32_t>(std::floor(at)), 0, last - 1);
    return {&views_[static_cast<std::size_t>(first)], &views_[static_cast<std::size_t>(first) + 1],
            at - first};
}

} // namespace obscura::renderer
