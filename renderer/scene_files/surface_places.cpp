// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene_files/surface_places.hpp"

#include "core/error.hpp"
#include "core/text/printable.hpp"
#include "renderer/planets/planet_parameters.hpp"
#include "renderer/registries/registry.hpp"
#include "renderer/scene/position.hpp"
#include "renderer/scene/sampled_pose_path.hpp"
#include "renderer/scene/scene_tree.hpp"
#include "renderer/scene/surface_place.hpp"
#include "renderer/truth/landmarks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace obscura::scene {
namespace {

/// Shapes of the bodies whose ground is asked for, each made once.
class Grounds {
public:
    explicit Grounds(const Scene& scene) : scene_(scene) {}

    [[nodiscard]] const renderer::Shape& shape(std::int32_t body) {
        std::shared_ptr<const renderer::Shape>& made = made_[body];
        if (!made) {
            const Body& description = scene_.bodies[static_cast<std::size_t>(body)];
            context_.place = fmt::format("body '{}'", description.name);
            made = at_position(description.position,
                               [&] { return renderer::make_shape(description.shape, context_); });
        }
        return *made;
    }

private:
    const Scene& scene_;
    renderer::ShapeContext context_;
    std::map<std::int32_t, std::shared_ptr<const renderer::Shape>> made_;
};

/// Refuses bodies on which places have no meaning. Returns the radii of the reference ellipsoid, 0 without
/// one.
Vec3 radii_for(const SurfaceTrack& track, const Body& body) {
    const std::string name = printable(body.name);
    if (body.shape.get_if<renderer::TerrainParameters>() != nullptr)
        throw ConfigError(placed(
            track.position, fmt::format("body '{}' is a plane, which has no longitudes; \"position_m\" is "
                                        "wanted",
                                        name)));
    const std::optional<Vec3> radii_m = renderer::reference_radii_m(body.shape);
    if (!radii_m && (track.above == HeightAbove::reference || track.latitudes == Latitudes::planetographic))
        throw ConfigError(placed(
            track.position,
            fmt::format("body '{}' is a {}, which has no reference ellipsoid; allowed are altitude_above = "
                        "\"ground\" with planetocentric latitudes, or a parent of shape ellipsoid or planet",
                        name, body.shape.kind())));
    return radii_m.value_or(Vec3{});
}

/// Heights of `track` above the ground as heights above the reference ellipsoid, or above the origin.
void add_ground(SurfaceTrack& track, Vec3 radii_m, const renderer::Shape& shape, const Body& body) {
    for (SurfacePlace& place : track.places) {
        const HeightLine line =
            height_line(direction_of(place.longitude_rad, place.latitude_rad), track.latitudes, radii_m);
        const auto ground_m = renderer::ground_height_m(shape, line, renderer::GroundDetail::finest);
        if (!ground_m)
            throw ConfigError(
                placed(track.position, fmt::format("body '{}' has no surface at that longitude and latitude",
                                                   printable(body.name))));
        place.height_m += *ground_m;
    }
    track.above = HeightAbove::reference;
}

/// Turns the places of `motion` on the body called `parent` into positions.
void find_places(const Scene& scene, const std::string& parent, Motion& motion, Grounds& grounds) {
    if (!motion.on_surface) return;
    SurfaceTrack track = *motion.on_surface;
    const std::int32_t index = index_of(scene.bodies, parent);
    if (index < 0 && parent == camera_name)
        throw ConfigError(
            placed(track.position, "the camera has no longitudes; allowed is a body as parent"));
    if (index < 0) return; // reported with the parents
    const Body& body = scene.bodies[static_cast<std::size_t>(index)];
    const Vec3 radii_m = radii_for(track, body);
    if (track.above == HeightAbove::ground) add_ground(track, radii_m, grounds.shape(index), body);
    const bool fixed = track.places.size() == 1 && !motion.path;
    const auto path =
        surface_path(std::move(track), radii_m, motion.path ? motion.path : path_of_samples(motion.samples));
    if (fixed) {
        motion.samples = {{0, path->at(0)}};
    } else {
        motion.path = path;
        motion.samples = samples_of(*path);
    }
    motion.on_surface = nullptr;
}

void aim_at_landmark(const Scene& scene, Motion& motion, Grounds& grounds) {
    if (!motion.aim || motion.aim->body.empty() || motion.aim->body == sun_name ||
        index_of(scene.bodies, motion.aim->body) >= 0)
        return;
    const auto landmark = std::find_if(scene.landmarks.begin(), scene.landmarks.end(),
                                       [&](const Landmark& l) { return l.name == motion.aim->body; });
    if (landmark == scene.landmarks.end()) return; // reported with the aims
    const std::int32_t index = index_of(scene.bodies, landmark->body);
    if (index < 0) return; // reported with the landmarks
    at_position(landmark->position, [&] {
        motion.aim->point_m =
            landmark->position_m
                ? *landmark->position_m
                : renderer::landmark_point(*landmark, scene.bodies[static_cast<std::size_t>(index)].shape,
                                           grounds.shape(index), renderer::GroundDetail::finest);
    });
    motion.aim->body = landmark->body;
}

} // namespace

void find_surface_places(Scene& scene, std::vector<SkyObject>& points, config::Mistakes& mistakes) {
    if (mistakes.count() > 0) return;
    Grounds grounds(scene);
    const auto collect = [&](const auto& find) {
        mistakes.collect([&] {
            try {
                find();
            } catch (const InputError& error) { // of files of shapes
                throw ConfigError(error.what());
            }
        });
    };
    const auto find = [&](const std::string& parent, Motion& motion) {
        collect([&] { find_places(scene, parent, motion, grounds); });
    };
    find(scene.camera.parent, scene.camera.motion);
    for (Body& body : scene.bodies)
        find(body.parent, body.motion);
    for (Lamp& lamp : scene.lamps)
        find(lamp.parent, lamp.motion);
    for (SkyObject& point : points)
        find(point.parent, point.motion);
    collect([&] { aim_at_landmark(scene, scene.camera.motion, grounds); });
    for (Lamp& lamp : scene.lamps)
        collect([&] { aim_at_landmark(scene, lamp.motion, grounds); });
}

void aim_at_landmark(const Scene& scene, Motion& motion) {
    Grounds grounds(scene);
    aim_at_landmark(scene, motion, grounds);
}

} // namespace obscura::scene
