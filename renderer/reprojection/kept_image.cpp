// SPDX-License-Identifier: Apache-2.0
#include "renderer/reprojection/kept_image.hpp"

#include "renderer/camera/aberration.hpp"

#include <algorithm>
#include <cmath>

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
