// SPDX-License-Identifier: Apache-2.0
#include "renderer/passes/truth_pass.hpp"

#include "renderer/integrators/ray_query.hpp"
#include "renderer/passes/row_set_up.hpp"
#include "renderer/passes/row_tracer.hpp"
#include "renderer/truth/body_light.hpp"
#include "renderer/truth/row_states.hpp"
#include "renderer/world/kinematics.hpp"
#include "renderer/world/pose_age.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

namespace obscura::renderer {
namespace {

/// Traces as frames are traced, one instant after another.
class TracedLight final : public BodyLight {
public:
    TracedLight(const BuiltScene& built, Scratch& scratch) : built_(built), scratch_(scratch) {}

    [[nodiscard]] BandLight irradiance(std::size_t body, double time_s, const Region& sensor) override {
        return traced(time_s, [&](const RowState& row, Tracer& tracer, BandLight& light) {
            trace_irradiance(row, static_cast<std::int32_t>(body), *scratch_.lens, sensor, tracer,
                             scratch_.candidates, light);
        });
    }
    [[nodiscard]] BandLight radiance(std::size_t body, double time_s, Vec3 direction) override {
        return traced(time_s, [&](const RowState& row, Tracer& tracer, BandLight& light) {
            trace_radiance(row, static_cast<std::int32_t>(body), direction, built_.pixel_width_rad(), tracer,
                           scratch_.candidates, light);
        });
    }

private:
    /// Calls `trace(row, tracer, light)`, whose light is in the channels and the unit of the tracer.
    template<typename Trace>
    BandLight traced(double time_s, const Trace& trace) {
        if (time_s != time_s_) begin_row(built_, time_s, scratch_);
        time_s_ = time_s;
        BandLight light{};
        with_tracer(built_, scratch_.whole.rows[0], scratch_,
                    [&](Tracer& tracer) { trace(scratch_.whole.rows[0], tracer, light); });
        if (built_.plain) {
            const double per_sun = light[0];
            for (std::size_t b = 0; b < built_.sun_w_m2.size(); ++b)
                light[b] = per_sun * built_.sun_w_m2[b];
        }
        return light;
    }

    const BuiltScene& built_;
    Scratch& scratch_;
    double time_s_ = std::numeric_limits<double>::quiet_NaN(); ///< of the first row state
};

/// The scene as a frame shows it. Pins the tiles of the frame in `s`.
TruthScene truth_scene(const BuiltScene& built, const TileLoading& tile_loading, const FieldStars& stars,
                       std::uint64_t frame_id, std::optional<Time> common, Scratch& s) {
    s.frame = tile_loading.frame_key(frame_id, common);
    s.tile_versions.assign(built.bodies.size(), 0);
    for (std::size_t b = 0; b < built.bodies.size(); ++b)
        if (const SurfaceTiles* const tiles = built.bodies[b].shape->tiles(); tiles != nullptr)
            s.tile_versions[b] = tiles->version_of(s.frame);
    s.pins.clear();
    for (const SurfaceTiles* const tiles : built.terrains)
        s.pins.push_back(tiles->pin());
    return {built.scene,
            built.bodies,
            *built.lens,
            built.gaussian_psf,
            built.psf.get(),
            built.landmarks_m,
            stars,
            built.splatter.sky(),
            built.sun_w_m2,
            built.star_energy_um,
            built.settings.max_instants,
            built.splatter.reach_px(),
            built.field_rad,
            s.tile_versions,
            built.settings.wait_for_tiles};
}

} // namespace

void fill_ground_truth(const BuiltScene& built, Time t, GroundTruth& truth) noexcept {
    const double time_s = to_seconds(t.ns);
    truth.mid_exposure = t;
    truth.camera = camera_pose(built.scene, built.bodies, time_s);
    truth.camera_pose_age_s = camera_pose_age_s(built.scene, built.bodies, time_s);
    truth.sun_position_m = built.scene.sun.position_at(time_s);
    truth.seed = built.settings.seed;
    truth.intrinsics = built.scene.camera.intrinsics();
    const auto& bodies = built.scene.bodies;
    truth.body_count = static_cast<std::uint32_t>(std::min(bodies.size(), max_truth_bodies));
    for (std::uint32_t i = 0; i < truth.body_count; ++i) {
        BodyTruth& body = truth.bodies[i];
        body.name.fill('\0');
        const std::string& name = bodies[i].name;
        std::copy_n(name.begin(), std::min(name.size(), body.name.size() - 1), body.name.begin());
        body.pose = seen_pose(built.scene, built.bodies, i, truth.camera.position_m, time_s);
        body.pose_age_s = body_pose_age_s(built.scene, built.bodies, i, time_s);
    }
}

void list_frame_truth(const BuiltScene& built, const TileLoading& tiles, const TruthRequest& request,
                      StarsInView& in_view, Scratch& scratch, SceneTruth& truth) {
    built.splatter.star_rows().find(request.rows, in_view);
    TruthScene scene =
        truth_scene(built, tiles, in_view.stars, request.frame_id, common_mid(request.rows), scratch);
    TracedLight light(built, scratch);
    scene.light = &light;
    list_truth(scene, request, truth);
    scratch.pins.clear();
    scratch.detail = {}; // not of a picture
}

Overlay frame_overlay(const BuiltScene& built, const TileLoading& tiles, const OverlayRequest& request,
                      TruthMemory& memory) {
    auto& [in_view, scratch] = memory;
    double more_rad = 0;
    if (!request.rows.empty()) {
        const double first_s = to_seconds(request.rows.front().mid().ns);
        const double last_s = to_seconds(request.rows.back().mid().ns);
        const auto attitude = [&](double t) { return camera_pose(built.scene, built.bodies, t).orientation; };
        const Quat turn = conjugate(attitude(first_s)) * attitude(last_s);
        more_rad = 2 * std::atan2(length({turn.x, turn.y, turn.z}), std::abs(turn.w)) +
                   2 * length(camera_beta(built.scene, built.bodies, first_s));
    }
    built.splatter.star_rows().find(request.truth.camera, more_rad, to_seconds(request.mid.ns), in_view);
    TruthScene scene =
        truth_scene(built, tiles, in_view.stars, request.frame_id, common_mid(request.rows), scratch);
    scene.max_instants = 1; // the middle of the exposure is near enough to the eye
    scene.poses = &request.truth;
    scene.poses_s = to_seconds(request.mid.ns);
    Overlay overlay = make_overlay(scene, request);
    scratch.pins.clear();
    return overlay;
}

} // namespace obscura::renderer
