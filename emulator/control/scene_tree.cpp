// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/scene_tree.hpp"

#include "emulator/control/camera_calls.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace obscura::emulator {
namespace {

using nlohmann::json;
using service::Answer;

/// What moves it when no pose has been received.
std::string motion_of(const scene::Motion& motion) {
    std::string text = motion.path ? "file" : motion.samples.size() > 1 ? "trajectory" : "fixed";
    if (motion.spin_rate_rad_s != 0) text += ", spinning";
    if (motion.aim) text += ", aimed at " + (motion.aim->body.empty() ? "a point" : motion.aim->body);
    return text;
}

/// Parent and source of the poses of a body, a lamp or the camera.
json placed(const std::string& name, const std::string& parent, const scene::Motion& motion,
            const PoseRings& rings) {
    json row{{"name", name}, {"parent", parent}, {"motion", motion_of(motion)}};
    const auto ring = rings.find(name);
    const bool received = ring != rings.end() && ring->second->count() > 0;
    row["source"] = received ? "simulator" : "scene";
    row["poses_received"] = received ? ring->second->count() : std::uint64_t{0};
    row["newest_pose_s"] = received ? json(ring->second->newest_s()) : json();
    return row;
}

/// Times of the points of all trajectories in the scene, each once; the first ones where there are many.
std::vector<double> trajectory_times(const scene::Scene& scene) {
    constexpr std::size_t most = 1000;
    std::set<double> times;
    const auto add = [&times](const scene::Motion& motion) {
        if (motion.path || motion.samples.size() < 2) return;
        for (const auto& sample : motion.samples)
            times.insert(sample.time_s);
    };
    add(scene.camera.motion);
    for (const scene::Body& body : scene.bodies)
        add(body.motion);
    for (const scene::Lamp& lamp : scene.lamps)
        add(lamp.motion);
    std::vector<double> first(times.begin(), times.end());
    first.resize(std::min(first.size(), most));
    return first;
}

/// Angle under which the sensor sees `pixels` of that pitch, without distortion; of a model as if a
/// pinhole's.
double field_of_view_deg(const scene::Camera& camera, double pixels, double pitch_m) {
    using P = scene::Projection;
    const double half = pixels * pitch_m / 2 / camera.focal_length_m;
    const auto angle = [&] {
        switch (camera.projection) {
        case P::equidistant:
            return half;
        case P::equisolid:
            return 2 * std::asin(std::min(half / 2, 1.0));
        case P::stereographic:
            return 2 * std::atan(half / 2);
        case P::orthographic:
            return std::asin(std::min(half, 1.0));
        case P::pinhole:
        case P::model:
            break;
        }
        return std::atan(half);
    };
    return 2 * angle() * 180 / std::numbers::pi;
}

} // namespace

json scene_tree(const ShownScene& shown) {
    const scene::Scene& scene = shown.scene;
    const scene::Camera& lens = scene.camera;
    json camera = placed("camera", lens.parent, lens.motion, shown.rings);
    camera["width"] = lens.width;
    camera["height"] = lens.height;
    camera["focal_length_m"] = lens.focal_length_m;
    camera["projection"] = name_of(lens.projection);
    camera["field_of_view_deg"] = {field_of_view_deg(lens, lens.width, lens.pixel_pitch_m),
                                   field_of_view_deg(lens, lens.height, lens.row_pitch_m())};
    json bodies = json::array(), lamps = json::array();
    for (const scene::Body& body : scene.bodies) {
        bodies.push_back(placed(body.name, body.parent, body.motion, shown.rings));
        bodies.back()["shape"] = body.shape.kind();
        bodies.back()["material"] = body.material.kind();
    }
    for (const scene::Lamp& lamp : scene.lamps)
        lamps.push_back(placed(lamp.name, lamp.parent, lamp.motion, shown.rings));
    json simulator;
    if (shown.simulator)
        simulator = {{"listen", shown.config.simulator.listen},
                     {"connections", shown.simulator->connections},
                     {"poses", shown.simulator->poses},
                     {"steps", shown.simulator->steps},
                     {"refused", shown.simulator->refused}};
    return {{"name", scene.name},
            {"file", shown.config.scene_file},
            {"scene_time", name_of(shown.config.daemon.scene_time)},
            {"dated", scene.epoch.has_value()},
            {"trajectory_s", trajectory_times(scene)},
            {"sun", {{"shines", scene.sun.irradiance_scale > 0}, {"moves", scene.sun.path != nullptr}}},
            {"camera", std::move(camera)},
            {"bodies", std::move(bodies)},
            {"lamps", std::move(lamps)},
            {"simulator", std::move(simulator)}};
}

service::Call scene_tree_call(std::function<json(std::size_t camera)> describe) {
    service::Call call = service::call<CameraNumber>(
        "scene.describe", service::Permission::view,
        "Describes the scene that a camera shows: its bodies and lamps, and where their poses come from. "
        "Where they are tells `truth`.",
        [describe = std::move(describe)](const CameraNumber& which, service::Work& /*work*/) {
            return Answer{describe(which.camera)};
        });
    call.results = {{"name", "string", "", "Name of the scene"},
                    {"file", "string", "", "Its file"},
                    {"scene_time", "string", "", "Clock that it follows: daemon.scene_time"},
                    {"dated", "boolean", "", "Whether scene time 0 has a date"},
                    {"trajectory_s", "array of numbers", "s",
                     "Scene times of the points of trajectories in the scene, increasing, the first 1000"},
                    {"sun", "map", "", "shines; moves"},
                    {"camera", "map", "",
                     "As a body; width and height of the sensor, px; focal_length_m; projection; "
                     "field_of_view_deg, across and down, without distortion"},
                    {"bodies", "array of maps", "",
                     "name; parent, \"\" for the inertial frame; "
                     "motion in the scene: fixed, trajectory or file, spinning, aimed at a body; "
                     "source of its pose now: scene or simulator; poses_received; "
                     "newest_pose_s, scene time of the newest one; shape, material"},
                    {"lamps", "array of maps", "", "As bodies, without shape and material"},
                    {"simulator", "map", "", "listen, connections, poses, steps, refused; nil: no port"}};
    return call;
}

} // namespace obscura::emulator
