// SPDX-License-Identifier: Apache-2.0
#include "renderer/received/received_light.hpp"

#include "core/error.hpp"
#include "core/solar_spectrum.hpp"
#include "core/text/suggestion.hpp"
#include "renderer/camera/aberration.hpp"
#include "renderer/passes/row_set_up.hpp"
#include "renderer/passes/scratch.hpp"
#include "renderer/passes/tile_loading.hpp"
#include "renderer/received/balance.hpp"
#include "renderer/received/caustics.hpp"
#include "renderer/received/direct_irradiance.hpp"
#include "renderer/received/exchange.hpp"
#include "renderer/scene/scene_tree.hpp"

#include <fmt/format.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <optional>
#include <thread>
#include <utility>

namespace obscura::renderer {
namespace {

/// A scene as bodies are lit at one instant: nothing of what a camera sees later or elsewhere.
scene::Scene at_one_instant(scene::Scene scene) {
    scene.light_time = scene.aberration = scene.light_deflection = false;
    return scene;
}

/// Samples of a whole body at least: points with shadow rays, or directions to a body far away, and
/// directions to surfaces nearby, by which its sums err by about 1 %.
constexpr std::size_t min_body_points = 4096, min_body_directions = std::size_t{1} << 18;

/// Samples of each patch of a body that takes at least so many in all.
std::uint32_t samples_of_patch(std::uint32_t at_least, const Receivers& receivers, std::size_t min_body) {
    const std::size_t patches = std::max<std::size_t>(receivers.patches().size(), 1);
    return std::max(at_least, static_cast<std::uint32_t>((min_body + patches - 1) / patches));
}

RenderSettings render_settings(const ReceivedLightSettings& settings) {
    RenderSettings out;
    out.threads = settings.threads;
    out.seed = settings.seed;
    out.max_bounces = 1; // of a kind that needs all channels
    return out;
}

} // namespace

struct ReceivedLightMap::Impl {
    Impl(scene::Scene scene, ReceivedLightSettings s)
        : settings(std::move(s)),
          built(at_one_instant(std::move(scene)), render_settings(settings)),
          tiles(built),
          arena(static_cast<int>(built.settings.threads)) {
        if (built.settings.threads > std::thread::hardware_concurrency())
            more_threads.emplace(tbb::global_control::max_allowed_parallelism, built.settings.threads);
        built.set_lighting();
        for (const std::string& name : settings.bodies)
            if (scene::index_of(built.scene.bodies, name) < 0)
                throw ConfigError(fmt::format("no body is called '{}', {}", name,
                                              allowed_words(name, scene::names_of(built.scene.bodies))));
        patches = make_patch_scene(built, settings.rows);
        sun_w_m2 = built.sun_w_m2;
        const double in_bands = std::accumulate(sun_w_m2.begin(), sun_w_m2.end(), 0.0);
        const double all = solar_constant_w_m2 * built.scene.sun.irradiance_scale;
        solar_share = all > 0 ? in_bands / all : 0;
        if (settings.whole_spectrum && in_bands > 0)
            for (double& band : sun_w_m2)
                band *= all / in_bands;
    }

    [[nodiscard]] bool wanted(const PatchBody& body) const {
        const std::string& name = built.scene.bodies[static_cast<std::size_t>(body.index)].name;
        return settings.bodies.empty() ||
               std::find(settings.bodies.begin(), settings.bodies.end(), name) != settings.bodies.end();
    }
    bool report(double share) {
        if (settings.go_on && !settings.go_on(share)) stopped = true;
        return !stopped;
    }

    ReceivedLight light(double time_s);
    void trace(const PatchRays& rays);
    /// Whether the bodies are where they were when `exchange` was traced.
    [[nodiscard]] bool kept(const RowState& row) const;

    ReceivedLightSettings settings;
    BuiltScene built;
    TileLoading tiles;
    std::optional<tbb::global_control> more_threads;
    tbb::task_arena arena;
    PatchScene patches;
    std::vector<double> sun_w_m2;
    double solar_share = 0;
    Scratch scratch;
    std::vector<BodyExchange> exchange;
    std::vector<Pose> exchange_poses;
    std::atomic<bool> stopped{false};
};

bool ReceivedLightMap::Impl::kept(const RowState& row) const {
    if (exchange_poses.size() != row.bodies.size()) return false;
    // A body alone may turn: what its patches see of each other turns with it.
    if (patches.bodies.size() == 1) return true;
    for (const PatchBody& body : patches.bodies) {
        const auto i = static_cast<std::size_t>(body.index);
        if (!(exchange_poses[i] == row.bodies[i].seen.pose)) return false;
    }
    return true;
}

void ReceivedLightMap::Impl::trace(const PatchRays& rays) {
    exchange.clear();
    exchange_poses.clear();
    std::size_t packets = 0, before = 0;
    for (const PatchBody& body : patches.bodies)
        packets += body.receivers->packets();
    for (const PatchBody& body : patches.bodies) {
        const Receivers& receivers = *body.receivers;
        const bool bounces = settings.max_bounces > 0;
        const std::uint32_t directions =
            bounces ? samples_of_patch(settings.directions, receivers, min_body_directions) : 0;
        const std::uint32_t far =
            bounces ? samples_of_patch(settings.far_directions, receivers, min_body_points) : 0;
        exchange.push_back(trace_exchange(rays, body, directions, far, settings.seed, [&](std::size_t done) {
            return done % 64 != 0 || report(0.9 * static_cast<double>(before + done) /
                                            static_cast<double>(std::max(packets, std::size_t{1})));
        }));
        before += body.receivers->packets();
    }
    for (const BodyState& body : rays.row().bodies)
        exchange_poses.push_back(body.seen.pose);
}

ReceivedLight ReceivedLightMap::Impl::light(double time_s) {
    const RowState& row = begin_row(built, time_s, scratch);
    const PatchRays rays(patches, row);
    if (!kept(row)) trace(rays);
    ReceivedLight out;
    out.solar_share = solar_share;
    std::vector<DirectIrradiance> direct;
    for (const PatchBody& body : patches.bodies) {
        direct.push_back(gather_direct(rays, body, sun_w_m2,
                                       samples_of_patch(settings.points, *body.receivers, min_body_points),
                                       settings.seed));
        out.rays += direct.back().rays;
    }
    const Caustics caustics = shoot_photons(rays, sun_w_m2, settings.photons, settings.seed,
                                            [&](std::uint64_t) { return report(0.95); });
    out.rays += caustics.rays;
    Balance balance(rays, exchange, direct, caustics, sun_w_m2);
    out.bounces = balance.solve(settings.max_bounces);
    std::uint64_t seen = 0, inner = 0;
    for (const BodyExchange& e : exchange) {
        seen += e.rays;
        inner += e.inner_hits;
        out.rays += e.rays;
    }
    out.inner_share = seen > 0 ? static_cast<double>(inner) / static_cast<double>(seen) : 0;
    for (std::size_t i = 0; i < patches.bodies.size(); ++i) {
        const PatchBody& body = patches.bodies[i];
        if (!wanted(body)) continue;
        BodyReceivedLight light = balance.light_of(i, settings.seed);
        light.name = built.scene.bodies[static_cast<std::size_t>(body.index)].name;
        const BuiltBody& from = built.bodies[static_cast<std::size_t>(body.index)];
        if (from.textures && from.textures->varies())
            out.notes.push_back(fmt::format(
                "body '{}': maps of its law's parameters count with the law's own values", light.name));
        if (body.receivers->area_m2() <= 0)
            out.notes.push_back(fmt::format(
                "body '{}': its surface has no cells of longitude and latitude that rays to its origin meet",
                light.name));
        out.bodies.push_back(std::move(light));
    }
    if (out.inner_share > 1e-3)
        out.notes.push_back(fmt::format(
            "{:.2g} % of the rays from patches meet inner sides of facets, which count as dark: meshes should be closed, with their corners counter-clockwise from outside",
            100 * out.inner_share));
    return out;
}

ReceivedLightMap::ReceivedLightMap(scene::Scene scene, ReceivedLightSettings settings)
    : impl_(std::make_unique<Impl>(std::move(scene), std::move(settings))) {}
ReceivedLightMap::~ReceivedLightMap() = default;
ReceivedLightMap::ReceivedLightMap(ReceivedLightMap&&) noexcept = default;
ReceivedLightMap& ReceivedLightMap::operator=(ReceivedLightMap&&) noexcept = default;

const scene::Scene& ReceivedLightMap::scene() const {
    return impl_->built.scene;
}

std::optional<ReceivedLight> ReceivedLightMap::at(double time_s) {
    std::optional<ReceivedLight> out;
    impl_->stopped = false;
    impl_->arena.execute([&] { out = impl_->light(time_s); });
    if (!impl_->stopped) return out;
    impl_->exchange_poses.clear();
    return std::nullopt;
}

std::optional<ReceivedLight> ReceivedLightMap::at(double time_s, Vec3 sun_m) {
    scene::Sun& sun = impl_->built.scene.sun;
    const scene::Sun own = sun;
    sun.position_m = sun_m;
    sun.path = nullptr;
    std::optional<ReceivedLight> out = at(time_s);
    sun = own;
    return out;
}

} // namespace obscura::renderer
