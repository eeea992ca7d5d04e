// SPDX-License-Identifier: Apache-2.0
#include "emulator/body_positions.hpp"

#include "renderer/camera/projection.hpp"
#include "renderer/renderer.hpp"
#include "renderer/world/view.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>

namespace obscura::emulator {
namespace {

/// The point of the composed image where a point of the sensor is: in the window that has it, else by the
/// first.
void to_image(const FrameInfo& frame, BodyPosition& body) {
    const std::span windows(frame.windows.data(), std::min<std::size_t>(frame.window_count, max_windows));
    if (windows.empty() || !body.x_px) return;
    const double x = *body.x_px, y = *body.y_px;
    const auto has = [x, y](const FrameWindow& window) {
        const Region& r = window.sensor;
        return x >= r.x - 0.5 && x < r.x + r.width - 0.5 && y >= r.y - 0.5 && y < r.y + r.height - 0.5;
    };
    const auto found = std::find_if(windows.begin(), windows.end(), has);
    const FrameWindow& window = found == windows.end() ? windows.front() : *found;
    body.x_px = x - window.sensor.x;
    body.y_px = y - window.sensor.y + window.image_y;
}

} // namespace

BodyPositions::BodyPositions(const renderer::Renderer& renderer)
    : lens_(renderer::make_projection(renderer.scene().camera)) {
    for (const renderer::SeenBody& body : renderer.view(Time{}).bodies)
        radius_m_[body.name] = body.extent_m / 2;
}

BodyPositions::~BodyPositions() = default;

std::vector<BodyPosition> BodyPositions::of(const FrameInfo& frame) const {
    const GroundTruth& truth = frame.truth;
    std::vector<BodyPosition> list;
    for (std::size_t i = 0; i < std::min<std::size_t>(truth.body_count, truth.bodies.size()); ++i) {
        const BodyTruth& there = truth.bodies[i];
        BodyPosition body;
        body.name = {there.name.data(), ::strnlen(there.name.data(), there.name.size())};
        body.position_m = there.pose.position_m;
        const Vec3 towards = to_local(truth.camera, body.position_m);
        body.range_m = length(towards);
        if (const auto point = body.range_m > 0 ? lens_->project(towards) : std::nullopt) {
            body.x_px = point->x;
            body.y_px = point->y;
            to_image(frame, body);
        }
        const auto radius_m = std::find_if(radius_m_.begin(), radius_m_.end(), [&body](const auto& one) {
            return one.first.substr(0, BodyTruth{}.name.size() - 1) == body.name; // long names are cut
        });
        if (radius_m != radius_m_.end() && radius_m->second < body.range_m)
            body.radius_px =
                std::asin(radius_m->second / body.range_m) / lens_->local_pixel_angle_rad(towards);
        list.push_back(std::move(body));
    }
    return list;
}

} // namespace obscura::emulator
