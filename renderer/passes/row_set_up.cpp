// SPDX-License-Identifier: Apache-2.0
#include "renderer/passes/row_set_up.hpp"

#include "renderer/planets/sun_visibility.hpp"
#include "renderer/world/kinematics.hpp"
#include "renderer/world/planetshine.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::renderer {
namespace {

/// First samples of pixels of adaptive sampling where something moves: with fewer, too many of those that an
/// edge crosses during the exposure see only one side of it (measured by noise_estimate_test.cpp).
constexpr std::uint32_t min_moving_samples = 8;

/// QualityLevel::instants.
constexpr std::uint32_t fewer_instants = 4;

} // namespace

Exposure exposure_of(const BuiltScene& built, const RowTime& row, Scratch& s) {
    if (built.settings.max_instants > 1 && s.measured != row) {
        s.measured = row;
        s.motion = motion_px(built.scene, built.bodies, *built.lens, built.splatter.reach_px(), row);
    }
    return Exposure::of(row, s.motion, built.settings.max_instants);
}

Exposure exposure_at(const BuiltScene& built, QualityLevel level, const RowTime& row, Scratch& s) {
    Exposure when = exposure_of(built, row, s);
    if (level >= QualityLevel::grid) return {row, 1};
    if (level >= QualityLevel::instants) when.instants = std::max(1U, when.instants / fewer_instants);
    return when;
}

std::uint32_t min_samples_of(const BuiltScene& built, const Exposure& when) {
    return built.settings.target_error > 0 && when.instants > 1 ? min_moving_samples : 1;
}

void set_lens(const BuiltScene& built, Vec3 beta, Scratch& s) {
    s.lens = built.lens.get();
    if (length(beta) > 0) s.lens = &s.moving_lens.emplace(*built.lens, beta);
}

RowState& begin_row(const BuiltScene& built, double time_s, Scratch& s, std::size_t i,
                    std::uint32_t min_samples) {
    return begin_row(built, time_s, s, s.whole, i, min_samples);
}

RowState& begin_row(const BuiltScene& built, double time_s, Scratch& s, RowSetUp& states, std::size_t i,
                    std::uint32_t min_samples) {
    states.request = 0;
    if (states.rows.size() <= i) states.rows.resize(i + 1);
    RowState& row = states.rows[i];
    row.beta = camera_beta(built.scene, built.bodies, time_s);
    set_lens(built, row.beta, s);
    set_row_state(built.scene, built.bodies, *s.lens, built.sample_reach_px(),
                  std::max(built.settings.samples_per_pixel, min_samples), time_s, row);
    for (BodyState& body : row.bodies)
        if (body.shape->counts_doubts()) body.detail.counts = &s.detail;
    if (!built.terrains.empty())
        for (BodyState& body : row.bodies) {
            if (!(body.detail.cell_rad > 0)) continue;
            body.detail.wait = built.settings.wait_for_tiles || s.waits;
            body.detail.version = body.shape->tiles()->version_of(s.frame);
            body.detail.counts = &s.detail;
            if (body.shape->tiles()->sun_visibility() != nullptr)
                body.detail.sun = rounded_sun(body.sun_m, built.scene.sun.radius_m);
        }
    if (built.lighting.max_bounces > 0 && built.lighting.has_sun()) find_planetshine(row);
    s.work.lap(RenderPart::setup);
    return row;
}

void begin_rows(const BuiltScene& built, std::uint64_t request, const Exposure& when, Scratch& s,
                RowSetUp& states) {
    if (states.request == request && states.time == when.row && states.instants == when.instants) return;
    const std::uint32_t min_samples = min_samples_of(built, when);
    for (std::uint32_t i = 0; i < when.instants; ++i)
        begin_row(built, when.time_s(i), s, states, i, min_samples).duration_s =
            static_cast<double>(when.row.exposure_ns()) * 1e-9 / when.instants;
    join_instants({states.rows.data(), when.instants}, states.swept);
    states.request = request;
    states.time = when.row;
    states.instants = when.instants;
}

void reserve(const BuiltScene& built, Scratch& s, std::int32_t width) {
    const auto pixels = static_cast<std::size_t>(width);
    for (std::size_t i = 0; i < built.settings.max_instants; ++i)
        begin_row(built, 0, s, i);
    join_instants(s.whole.rows, s.whole.swept);
    s.motion_of_row.resize(pixels);
    s.light.reserve(pixels * built.scene.bands.size());
    s.starlight.reserve(pixels * built.scene.bands.size());
    s.scanned.reserve(pixels * built.scene.bands.size());
    s.per_pixel.reserve(pixels);
    s.variance.reserve(pixels);
    s.candidates.reserve(built.bodies.size());
    s.pins.reserve(built.terrains.size());
}

bool has_small(std::span<const RowState> rows) {
    return std::any_of(rows.begin(), rows.end(), [](const RowState& row) {
        return std::any_of(row.bodies.begin(), row.bodies.end(), [](const BodyState& b) { return b.small; });
    });
}

bool resolves_any(const RowState& row, double field_rad) {
    const double reach_rad = field_rad + 2 * length(row.beta) + row.reach_rad + 1e-6;
    return std::any_of(row.bodies.begin(), row.bodies.end(), [&](const BodyState& b) {
        if (b.targeted) return false;
        const Vec3 d = b.direction;
        return b.cos_cone < 0 ||
               std::atan2(std::hypot(d.x, d.y), d.z) <= reach_rad + std::asin(std::min(1.0, b.cone_sine));
    });
}

} // namespace obscura::renderer
