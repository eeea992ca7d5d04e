// SPDX-License-Identifier: Apache-2.0
// Everything about one row's instant: poses, frames and who can shade whom.
#pragma once

#include "core/geometry.hpp"
#include "renderer/camera/projection.hpp"
#include "renderer/materials/material.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/shapes/shape.hpp"
#include "renderer/textures/surface_textures.hpp"

#include <cstdint>
#include <memory>
#include <vector>

namespace obscura::renderer {

/// A body as built from its description; the Sun is one of them, with no material.
struct BuiltBody {
    std::shared_ptr<const Shape> shape;
    std::shared_ptr<const Material> material; ///< none: the body is the Sun
    scene::Motion motion;
    std::vector<double> colour;                      ///< see scene::Body
    std::vector<double> emission;                    ///< see scene::Body
    std::shared_ptr<const SurfaceTextures> textures; ///< none: the same all over
    std::int32_t parent = -1; ///< index of the body whose frame the motion is in; -1: inertial
    scene::Joint joint;
    std::uint32_t first_material = 0; ///< number of its first material among those of all bodies, from 1
};

/// A body at the row's instant.
struct BodyState {
    const Shape* shape = nullptr;
    const Material* material = nullptr;
    const BuiltBody* built = nullptr;
    Mat3 to_inertial;     ///< body frame -> inertial axes
    Mat3 from_inertial;   ///< and back
    std::int32_t frame;   ///< bodies with the same number have the same pose
    Mat3 from_camera;     ///< camera frame -> body frame
    Vec3 camera_m;        ///< the camera in the body frame
    Vec3 sun_m;           ///< the Sun's centre in the body frame
    Vec3 position_m;      ///< inertial
    Vec3 direction;       ///< unit, camera frame, to the body's centre
    double cone_sine = 1; ///< of the bounding sphere's half angle
    double cos_cone = -1; ///< of that angle; -1 when the camera is inside
    /// Squared chord (distance between unit vectors) of that angle grown by what the footprint reaches: exact
    /// for the smallest cones, where cosines are not. 5: everywhere.
    double reach_chord2 = 5;
    double solid_angle_sr = 0;
    std::uint32_t samples = 0; ///< per pixel; 0: not seen in pixels
    /// Brightness of the surface that looks half way between Sun and camera, per irradiance of the Sun at
    /// 1 au, 1/sr: the level that errors are measured against. 0 for the Sun.
    double reference_radiance = 0;
    bool large = false;                  ///< so large that its limb is few of its pixels
    bool targeted = false;               ///< smaller than pixels: sampled itself, then splatted
    std::vector<std::int32_t> occluders; ///< bodies that may stand between it and the Sun
};

struct RowState {
    Pose camera;
    Mat3 camera_from_inertial;
    Mat3 inertial_from_camera;
    std::vector<BodyState> bodies;
    std::vector<Pose> lamps;
    double reach_rad = 0; ///< the farthest that a displaced camera sample is turned from its pixel's centre
};

/// The rotation from the frame of body `from` to that of body `to`, and where the origin of `from` lies
/// there.
[[nodiscard]] Mat3 relative_rotation(const BodyState& from, const BodyState& to);
[[nodiscard]] Vec3 relative_origin(const BodyState& from, const BodyState& to);

/// Bodies with a bounding sphere smaller than this are targeted.
constexpr double targeted_radius_px = 3;
/// One with a larger one leaves room for error at its limb: see BlockTracer.
constexpr double large_radius_px = 128;
/// A resolved body gets at least this many samples in all, so that its noise does not depend on its size.
constexpr double samples_per_body = 16384;
/// Samples of a targeted body.
constexpr std::uint32_t samples_per_target = 1024;

/// The pose of body `i` in which a camera at `camera_m` sees it at `time_s`: with Scene::light_time that of
/// the instant when the light left it, t' = t - |r(t') - camera| / c.
[[nodiscard]] Pose seen_pose(const scene::Scene& scene, const std::vector<BuiltBody>& bodies, std::size_t i,
                             Vec3 camera_m, double time_s);
/// The camera's velocity over that of light, in camera axes; 0 without Scene::aberration.
[[nodiscard]] Vec3 camera_beta(const scene::Scene& scene, const std::vector<BuiltBody>& bodies,
                               double time_s);

/// Fills `row` for `time_s` of scene time; camera samples are displaced by up to `sample_reach_px`. Bodies
/// get `samples_per_pixel` at least; `parts` such rows share those that a small one needs. Re-uses its
/// vectors.
void set_row_state(const scene::Scene& scene, const std::vector<BuiltBody>& bodies,
                   const Projection& projection, double sample_reach_px, std::uint32_t samples_per_pixel,
                   std::uint32_t parts, double time_s, RowState& row);

} // namespace obscura::renderer
