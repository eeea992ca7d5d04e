// SPDX-License-Identifier: Apache-2.0
// State of the scene at the instant of one row: poses, frames and occluders.
#pragma once

#include "core/geometry.hpp"
#include "renderer/camera/projection.hpp"
#include "renderer/materials/material.hpp"
#include "renderer/packets/detail_view.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/shapes/elevation_guide.hpp"
#include "renderer/shapes/lit_disc.hpp"
#include "renderer/shapes/lit_facets.hpp"
#include "renderer/shapes/shape.hpp"
#include "renderer/textures/surface_textures.hpp"
#include "renderer/world/light_time.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace obscura::renderer {

/// Body built from its description; the Sun is one of them, without a material.
struct BuiltBody {
    std::shared_ptr<const Shape> shape;
    std::shared_ptr<const Material> material; ///< null: the body is the Sun
    scene::Motion motion;
    std::vector<double> colour;                      ///< see scene::Body
    std::vector<double> emission;                    ///< see scene::Body
    std::shared_ptr<const SurfaceTextures> textures; ///< null: nothing varies over it
    std::int32_t parent = -1; ///< index of the body whose frame the motion is in; -1: inertial
    scene::Joint joint;
    /// Number of its first material slot among those of all bodies, from 1.
    std::uint32_t first_material = 0;
    std::shared_ptr<const ElevationGuide> guide; ///< of bounce rays; null: cosine-weighted
};

/// Sunlit body whose reflected light is sampled as a light source at another one.
struct PlanetshineSource {
    std::int32_t body = -1; ///< index in the row; -1: none
    double ratio = 0;       ///< estimate of its irradiance over the Sun's
};
/// Largest number of them for each body.
constexpr std::size_t max_planetshine_sources = 2;

/// A body at the row's instant.
struct BodyState {
    const Shape* shape = nullptr;
    const Material* material = nullptr;
    const BuiltBody* built = nullptr;
    Mat3 to_inertial;          ///< rotation, body frame to inertial axes
    Mat3 from_inertial;        ///< its inverse
    std::int32_t frame;        ///< bodies of equal number have the same pose
    Mat3 from_camera;          ///< rotation, camera frame to body frame
    Vec3 camera_m;             ///< origin of camera rays, body frame: see ApparentBody::eye_m()
    Vec3 sun_m;                ///< centre of the Sun, body frame: see ApparentBody::to_sun_m()
    ApparentBody seen;         ///< inertial
    double camera_error_m = 0; ///< rounding of `camera_m` by inertial coordinates
    Vec3 beta;                 ///< as that of `seen`, body frame
    Vec3 direction;            ///< unit, camera frame, to the body's centre
    double cone_sine = 1;      ///< sine of the half angle of the bounding cone
    double cos_cone = -1;      ///< its cosine; -1: camera inside the sphere
    /// Squared chord (distance between unit vectors) of that half angle plus RowState::reach_rad: accurate
    /// for the smallest cones, where cosines are not. 5: every direction.
    double reach_chord2 = 5;
    double solid_angle_sr = 0;
    double radius_px = 0;      ///< of the bounding cone; 0: camera inside
    LitDisc disc;              ///< from the camera
    std::uint32_t samples = 0; ///< per pixel; 0: not sampled by pixels
    /// Radiance of the surface whose normal is half way between Sun and camera, per irradiance of the Sun at
    /// 1 au, 1/sr: the reference level of the error. 0 for the Sun.
    double reference_radiance = 0;
    DetailView detail;     ///< of terrain; else its cells are 0, and it may have counts
    bool large = false;    ///< larger than large_radius_px: few limb pixels
    bool small = false;    ///< not targeted, at most small_radius_px: complete at every QualityLevel
    bool targeted = false; ///< sub-pixel: its directions are sampled, then splatted
    /// The lit part of its disc is too thin for pixel samples: sampled and splatted as a targeted body is.
    bool thin_crescent = false;
    std::vector<std::int32_t> occluders; ///< bodies that may shade it from the Sun
    /// The brightest first; none unless find_planetshine() was called.
    std::array<PlanetshineSource, max_planetshine_sources> planetshine;

    /// Facets that are splatted, of a thin crescent whose shape has facets.
    std::shared_ptr<const LitFacets> lit_facets;

    /// Direction of a camera ray (unit, camera frame) in the body frame, of unit length.
    [[nodiscard]] Vec3 direction_of(Vec3 towards) const {
        return seen.moves() ? normalized(from_camera * towards + beta) : from_camera * towards;
    }
    /// Vector of the body frame from the camera, in the camera frame: its length is the distance of light.
    [[nodiscard]] Vec3 to_camera(Vec3 from_camera_m) const {
        return transposed(from_camera) * (seen.moves() ? untilted(from_camera_m, beta) : from_camera_m);
    }
    /// For rays in the frame of this body; null: it is no terrain.
    [[nodiscard]] const DetailView* detail_view() const {
        return detail.cell_rad > 0 || detail.counts != nullptr ? &detail : nullptr;
    }
    /// Whether the light of a hit on `primitive` along `towards` (unit, camera frame) is splatted, core and
    /// wings; else it is sampled by pixels.
    [[nodiscard]] bool splatted(Vec3 towards, std::uint32_t primitive) const {
        return targeted ||
               (thin_crescent && (lit_facets ? lit_facets->has(primitive) : disc.lit(direction_of(towards))));
    }
};

/// Poses of everything at the instant of a row.
struct RowState {
    double time_s = 0;     ///< scene time of the instant
    double duration_s = 0; ///< part of the exposure that it stands for
    Pose camera;
    Mat3 camera_from_inertial;
    Mat3 inertial_from_camera;
    Vec3 beta{0, 0, 0}; ///< camera velocity over the speed of light, camera axes; 0 without aberration
    Vec3 sun_m;         ///< centre of the Sun, inertial
    std::vector<BodyState> bodies;
    std::vector<ApparentBody> lamps; ///< at the instants at which light left them, as bodies
    /// Largest angle between a displaced camera sample and its pixel's centre.
    double reach_rad = 0;
};

/// Rotation from the frame of body `from` to that of body `to`, and the origin of `from` in the frame of
/// `to`, when light was at `path_m` before the camera.
[[nodiscard]] Mat3 relative_rotation(const BodyState& from, const BodyState& to);
[[nodiscard]] Vec3 relative_origin(const BodyState& from, const BodyState& to, double path_m);
/// Whether light changes its direction from one frame to the other by more than their rotation.
[[nodiscard]] inline bool tilts(const BodyState& from, const BodyState& to) {
    return from.seen.moves() || to.seen.moves();
}
/// Direction of light, unit vector in the frame of `from`, in that of `to`. Sets the length there of a unit
/// of length here.
[[nodiscard]] Vec3 relative_direction(const BodyState& from, const BodyState& to, Vec3 direction,
                                      double& stretch);

/// Bodies with a smaller bounding sphere are targeted.
constexpr double targeted_radius_px = 3;
/// Bodies with a larger bounding sphere have few limb pixels, whose error may be larger: see BlockTracer.
constexpr double large_radius_px = 128;
/// Radius of bodies that sparse grids could lose, or whose centroids they would move.
constexpr double small_radius_px = 16;
/// Least number of samples of a resolved body in all, so that its noise does not depend on its size.
constexpr double samples_per_body = 16384;
/// Samples of a targeted body.
constexpr std::uint32_t samples_per_target = 1024;
/// Samples of the facets of such a body, if most of it is lit: the noise of its light is about 0.1 %.
constexpr std::uint32_t min_facet_samples = 8192;
/// Largest lit share of the disc, and lit area, of a thin crescent: with less light, pixel samples are too
/// few; of a larger area they are enough. Bodies with facets may be in shadow elsewhere.
constexpr double crescent_share = 0.25;
constexpr double rough_crescent_share = 0.5;
constexpr double crescent_area_px = 256;
/// Samples of a thin crescent per pixel of its area, between samples_per_target and four times as many.
constexpr double samples_per_crescent_px = 64;

/// Pose of body `i` that a camera at `camera_m` sees at `time_s`: with Scene::light_time that of the instant
/// at which the light left it, t' = t - |r(t') - camera| / c.
[[nodiscard]] Pose seen_pose(const scene::Scene& scene, std::span<const BuiltBody> bodies, std::size_t i,
                             Vec3 camera_m, double time_s);
/// As seen_pose(), where a straight line of sight meets it: with Scene::light_deflection the body is shifted
/// as the light of its centre is.
[[nodiscard]] Pose apparent_pose(const scene::Scene& scene, std::span<const BuiltBody> bodies, std::size_t i,
                                 Vec3 camera_m, double time_s);
/// The body of apparent_pose(), with its motion along the light if Scene::light_time is on.
[[nodiscard]] ApparentBody apparent_body(const scene::Scene& scene, std::span<const BuiltBody> bodies,
                                         std::size_t i, Vec3 camera_m, double time_s);
/// As apparent_body(), of a lamp, without deflection.
[[nodiscard]] ApparentBody apparent_lamp(const scene::Scene& scene, std::span<const BuiltBody> bodies,
                                         const scene::Lamp& lamp, Vec3 camera_m, double time_s);
/// As apparent_pose(), of the body at a pose that seen_pose() gave.
[[nodiscard]] Pose deflected(const scene::Scene& scene, Pose seen, Vec3 camera_m, double time_s);
/// Camera velocity over the speed of light, camera axes; 0 without Scene::aberration.
[[nodiscard]] Vec3 camera_beta(const scene::Scene& scene, const std::vector<BuiltBody>& bodies,
                               double time_s);

/// Fills `row`, but for RowState::beta, for `time_s` of scene time; camera samples are displaced by up to
/// `sample_reach_px`. Bodies get at least `samples_per_pixel`. Reuses the vectors of `row`.
void set_row_state(const scene::Scene& scene, const std::vector<BuiltBody>& bodies,
                   const Projection& projection, double sample_reach_px, std::uint32_t samples_per_pixel,
                   double time_s, RowState& row);

} // namespace obscura::renderer
