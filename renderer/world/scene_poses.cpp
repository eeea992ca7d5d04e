// SPDX-License-Identifier: Apache-2.0
#include "renderer/world/scene_poses.hpp"

#include "renderer/camera/aberration.hpp"
#include "renderer/scene/scene_tree.hpp"
#include "renderer/world/kinematics.hpp"

#include <cmath>
#include <utility>
#include <vector>

namespace obscura::renderer {
namespace {

double angle(Vec3 a, Vec3 b) {
    return std::atan2(length(cross(a, b)), dot(a, b));
}

/// Bodies that have a place and nothing else.
std::vector<BuiltBody> places_of(const scene::Scene& scene) {
    const std::vector<std::int32_t> parents = scene::parents_of(scene);
    std::vector<BuiltBody> places;
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        BuiltBody& place = places.emplace_back();
        place.motion = scene.bodies[i].motion;
        place.parent = parents[i];
        place.joint = scene.bodies[i].joint;
    }
    return places;
}

} // namespace

struct ScenePoses::Impl {
    scene::Scene scene;
    std::vector<BuiltBody> bodies;
    std::unique_ptr<Projection> lens;

    /// How a camera sees the point `pose.position_m` at `time_s`.
    [[nodiscard]] BodyView view(const Pose& pose, double time_s) const {
        const Pose camera = camera_pose(scene, bodies, time_s);
        const Vec3 place_m = deflected(scene, pose, camera.position_m, time_s).position_m;
        const Vec3 direction = rotate(conjugate(camera.orientation), place_m - camera.position_m);
        BodyView view{.pose = pose, .range_m = length(direction)};
        view.phase_rad =
            angle(scene.sun.position_at(time_s) - pose.position_m, camera.position_m - pose.position_m);
        if (!(view.range_m > 0)) return view;
        const Vec3 beta = camera_beta(scene, bodies, time_s);
        const Vec3 seen = scene.aberration ? aberrate(direction / view.range_m, beta) : direction;
        view.off_axis_rad = angle(seen, {0, 0, 1});
        view.pixel = lens->project(seen);
        return view;
    }
};

ScenePoses::ScenePoses(scene::Scene scene) : impl_(std::make_unique<Impl>()) {
    impl_->bodies = places_of(scene);
    impl_->lens = make_projection(scene.camera);
    impl_->scene = std::move(scene);
}
ScenePoses::~ScenePoses() = default;
ScenePoses::ScenePoses(ScenePoses&&) noexcept = default;
ScenePoses& ScenePoses::operator=(ScenePoses&&) noexcept = default;

const scene::Scene& ScenePoses::scene() const noexcept {
    return impl_->scene;
}

Pose ScenePoses::camera(double time_s) const {
    return camera_pose(impl_->scene, impl_->bodies, time_s);
}

Vec3 ScenePoses::camera_velocity_m_s(double time_s) const {
    if (!impl_->scene.aberration) return {};
    return renderer::camera_velocity_m_s(impl_->scene, impl_->bodies, time_s);
}

BodyView ScenePoses::body(std::size_t index, double time_s) const {
    const Vec3 camera_m = camera(time_s).position_m;
    return impl_->view(seen_pose(impl_->scene, impl_->bodies, index, camera_m, time_s), time_s);
}

BodyView ScenePoses::sun(double time_s) const {
    BodyView view = impl_->view({impl_->scene.sun.position_at(time_s), {}}, time_s);
    view.phase_rad = 0;
    return view;
}

} // namespace obscura::renderer
