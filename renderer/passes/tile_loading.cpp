// SPDX-License-Identifier: Apache-2.0
#include "renderer/passes/tile_loading.hpp"

#include "renderer/integrators/block_tracer.hpp"
#include "renderer/passes/row_set_up.hpp"
#include "renderer/passes/row_tracer.hpp"
#include "renderer/planets/sun_visibility.hpp"
#include "renderer/worker_threads.hpp"
#include "renderer/world/kinematics.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>

namespace obscura::renderer {
namespace {

/// Samples of a pixel of TileLoading::load().
constexpr std::uint32_t loading_samples = 4;

} // namespace

TileLoading::TileLoading(const BuiltScene& built) : built_(built) {
    const RenderSettings& settings = built.settings;
    if (settings.wait_for_tiles) return;
    for (const SurfaceTiles* const tiles : built.terrains)
        loaders_.push_back(std::make_unique<TileLoader>(
            *tiles,
            TileLoader::Settings{.tiles_per_s = settings.tiles_per_s,
                                 .enter = settings.enter_loader,
                                 .share = settings.loader_share,
                                 .busy = [this] { return under_way_.load(std::memory_order_relaxed) > 0; }}));
}

std::uint64_t TileLoading::frame_key(std::uint64_t frame_id, std::optional<Time> common_mid) const {
    if (loaders_.empty()) return 0;
    const auto mid = static_cast<std::uint64_t>(common_mid ? common_mid->ns : 0);
    return (frame_id * 0x9e3779b97f4a7c15ull ^ mid * 0xc2b2ae3d27d4eb4full) | 1;
}

void TileLoading::begin_frame(const RenderRequest& request) const {
    if (loaders_.empty()) return;
    for (const SurfaceTiles* const tiles : built_.terrains)
        tiles->begin_frame(frame_key(request.frame_id, request.common_mid));
    predict_views(request);
}

void TileLoading::predict_views(const RenderRequest& request) const {
    if (request.row_times.empty()) return;
    constexpr double ahead_s = 1;
    const scene::Scene& scene = built_.scene;
    const std::vector<BuiltBody>& bodies = built_.bodies;
    const std::vector<const SurfaceTiles*>& terrains = built_.terrains;
    const double time_s = to_seconds(request.row_times.front().mid().ns) + ahead_s;
    const Pose camera = camera_pose(scene, bodies, time_s);
    const Mat3 inertial_from_camera = to_matrix(camera.orientation);
    for (std::size_t k = 0; k < terrains.size(); ++k)
        for (std::size_t i = 0; i < bodies.size(); ++i) {
            if (bodies[i].shape->tiles() != terrains[k]) continue;
            const ApparentBody seen = apparent_body(scene, bodies, i, camera.position_m, time_s);
            const Mat3 from_inertial = transposed(to_matrix(seen.pose.orientation));
            // A tenth of the field more on each side.
            loaders_[k]->predict({from_inertial * (camera.position_m - seen.position_at(0)),
                                  from_inertial * (inertial_from_camera * Vec3{0, 0, 1}),
                                  1.1 * built_.field_rad,
                                  terrains[k]->cell_px() * built_.lens->pixel_angle_rad(),
                                  rounded_sun(from_inertial * seen.to_sun_m(scene.sun.position_at(time_s)),
                                              scene.sun.radius_m)});
            break;
        }
}

void TileLoading::load_row(const RenderRequest& request, std::int32_t r, Scratch& s) const {
    for (const SurfaceTiles* const tiles : built_.terrains)
        s.pins.push_back(tiles->pin());
    const double time_s = to_seconds(request.row_times[static_cast<std::size_t>(r)].mid().ns);
    const RowState& row = begin_row(built_, time_s, s);
    if (resolves_any(row, built_.field_rad))
        with_tracer(built_, row, s, [&](Tracer& tracer) {
            // With some rays a pixel, what frames take at random is met.
            const Sampling how{built_.settings.seed, request.frame_id, loading_samples};
            BlockTracer blocks(*s.lens, built_.gaussian_psf, built_.psf.get(), how, row, {}, tracer,
                               s.candidates);
            const Region& window = request.window;
            const std::int32_t last = BlockTracer::block_of(window.x + window.width - 1);
            BlockResult unused;
            for (std::int32_t block = BlockTracer::block_of(window.x); block <= last; ++block)
                blocks.trace(block, window.y + request.first_row + r, unused);
        });
    s.pins.clear();
}

bool TileLoading::load(const RenderRequest& request, const std::function<bool(double)>& go_on) const {
    if (built_.terrains.empty()) return true;
    if (!go_on(0)) return false;
    std::mutex mutex;
    std::condition_variable ended;
    unsigned working = built_.settings.threads; // with the mutex, as is `failure`
    std::exception_ptr failure;
    std::atomic<std::int32_t> next{0}, done{0};
    std::atomic<bool> stop{false};
    const auto work = [&] {
        const FlushDenormals flush;
        Scratch own;
        own.waits = true;
        std::exception_ptr failed;
        try {
            for (std::int32_t r = next++; r < request.rows && !stop; r = next++) {
                load_row(request, r, own);
                ++done;
            }
        } catch (...) {
            failed = std::current_exception();
            stop = true;
        }
        const std::lock_guard lock(mutex);
        if (failed) failure = failed;
        if (--working == 0) ended.notify_one();
    };
    {
        // Not the arena's workers, which render other frames meanwhile and may have a priority.
        std::vector<std::jthread> workers;
        for (unsigned i = 0; i < built_.settings.threads; ++i)
            workers.emplace_back(work);
        std::unique_lock lock(mutex);
        while (!ended.wait_for(lock, std::chrono::milliseconds(100), [&] { return working == 0; })) {
            lock.unlock();
            if (!go_on(static_cast<double>(done) / request.rows)) stop = true;
            lock.lock();
        }
    }
    for (const SurfaceTiles* const tiles : built_.terrains)
        tiles->publish();
    if (failure) std::rethrow_exception(failure);
    if (!loaders_.empty()) predict_views(request);
    return done == request.rows;
}

std::uint64_t TileLoading::made() const noexcept {
    std::uint64_t made = 0;
    for (const SurfaceTiles* const tiles : built_.terrains) {
        made += tiles->made();
        if (tiles->sun_visibility() != nullptr) made += tiles->sun_visibility()->made();
    }
    return made;
}

std::vector<Renderer::TerrainTiles> TileLoading::usage() const {
    std::vector<Renderer::TerrainTiles> out;
    for (const SurfaceTiles* const tiles : built_.terrains) {
        const auto body = std::find_if(built_.bodies.begin(), built_.bodies.end(),
                                       [&](const BuiltBody& b) { return b.shape->tiles() == tiles; });
        const SurfaceTiles::Usage usage = tiles->usage();
        const auto number = static_cast<std::size_t>(body - built_.bodies.begin());
        out.push_back({built_.scene.bodies[number].name, usage.made, usage.slots});
    }
    return out;
}

} // namespace obscura::renderer
