// SPDX-License-Identifier: Apache-2.0
#include "renderer/reprojection/kept_image.hpp"

#include "renderer/camera/aberration.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace obscura::renderer {

void KeptView::set(Time at, const RowState& row) {
    mid = at;
    camera_from_inertial = row.camera_from_inertial;
    beta = row.beta;
    bodies.resize(row.bodies.size());
    std::transform(row.bodies.begin(), row.bodies.end(), bodies.begin(), [](const BodyState& body) {
        return Body{body.from_camera, body.camera_m, body.sun_m, body.beta, body.seen.moves()};
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
        const Vec3 centre_then = then.to_camera(-then.camera_m);
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

KeptMemory::KeptMemory(std::size_t width, std::size_t rows, std::size_t images, std::size_t channels,
                       std::size_t bodies)
    : light_(channels * width * rows),
      lit_(rows),
      kept_(rows),
      views_(rows / KeptImage::line_view_rows + images) {
    for (KeptView& view : views_)
        view.bodies.reserve(bodies);
}

bool KeptImage::place(const KeptWindow& window, std::size_t channel_capacity, KeptMemory& memory) {
    window_ = window;
    view_step_ = window.line_y ? line_view_rows : view_rows;
    const auto rows = static_cast<std::size_t>(window.area.height);
    const std::size_t views = (rows - 1) / static_cast<std::size_t>(view_step_) + 1;
    const std::size_t floats = channel_capacity * rows * static_cast<std::size_t>(window.area.width);
    if (floats > memory.light_.size() - memory.floats_taken_ ||
        rows > memory.lit_.size() - memory.rows_taken_ ||
        views > memory.views_.size() - memory.views_taken_ || (window.line_y && views < 2))
        return false;
    light_ = std::span(memory.light_).subspan(memory.floats_taken_, floats);
    lit_ = std::span(memory.lit_).subspan(memory.rows_taken_, rows);
    kept_ = std::span(memory.kept_).subspan(memory.rows_taken_, rows);
    views_ = std::span(memory.views_).subspan(memory.views_taken_, views);
    memory.floats_taken_ += floats;
    memory.rows_taken_ += rows;
    memory.views_taken_ += views;
    return true;
}

void KeptImage::begin(std::size_t channels, std::size_t bodies, bool one_time) {
    channels_ = channels;
    one_time_ = one_time && !window_.line_y;
    for (KeptView& view : views_)
        view.bodies.reserve(bodies);
    std::fill(kept_.begin(), kept_.end(), std::uint8_t{0});
}

void KeptImage::keep_row(std::int32_t y, std::span<const double> light) {
    const Region& area = window_.area;
    const auto row = static_cast<std::size_t>(y - area.y);
    const auto width = static_cast<std::size_t>(area.width);
    const std::size_t plane_size = width * static_cast<std::size_t>(area.height);
    LitColumns lit{area.width, 0};
    for (std::size_t c = 0; c < channels_; ++c) {
        float* const out = light_.data() + c * plane_size + row * width;
        const double* const in = light.data() + c * width;
        std::int32_t first = 0;
        std::int32_t end = area.width;
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
    const auto last = static_cast<std::int32_t>(views_.size()) - 1;
    if (one_time_ || last == 0) return {views_.data(), views_.data(), 0};
    const double at = (y - area().y) / view_step_;
    const std::int32_t first = std::clamp(static_cast<std::int32_t>(std::floor(at)), 0, last - 1);
    return {&views_[static_cast<std::size_t>(first)], &views_[static_cast<std::size_t>(first) + 1],
            at - first};
}

double KeptImage::line_at(Time mid, double y) const {
    const Between about = views_about(y);
    const auto step_ns = static_cast<double>(about.second->mid - about.first->mid);
    if (!(step_ns > 0)) return y;
    const auto later_ns = static_cast<double>(mid - about.first->mid);
    return y + (later_ns / step_ns - about.share) * view_step_;
}

} // namespace obscura::renderer
