// SPDX-License-Identifier: Apache-2.0
#include "renderer/renderer.hpp"

#include "core/solar_spectrum.hpp"
#include "renderer/camera/aberration.hpp"
#include "renderer/camera/gaussian_psf.hpp"
#include "renderer/camera/projection.hpp"
#include "renderer/camera/psf.hpp"
#include "renderer/camera/stray_light.hpp"
#include "renderer/camera/wing_kernels.hpp"
#include "renderer/integrators/aovs.hpp"
#include "renderer/integrators/block_tracer.hpp"
#include "renderer/integrators/path_tracer.hpp"
#include "renderer/integrators/point_splatter.hpp"
#include "renderer/integrators/sample_grid.hpp"
#include "renderer/integrators/tracer.hpp"
#include "renderer/integrators/wing_maps.hpp"
#include "renderer/lights/lighting.hpp"
#include "renderer/lights/spectrum.hpp"
#include "renderer/packets/sampler.hpp"
#include "renderer/planets/surface_tiles.hpp"
#include "renderer/planets/tile_loader.hpp"
#include "renderer/scene/position.hpp"
#include "renderer/truth/body_light.hpp"
#include "renderer/truth/landmarks.hpp"
#include "renderer/truth/row_states.hpp"
#include "renderer/truth/scene_truth.hpp"
#include "renderer/work_clock.hpp"
#include "renderer/worker_threads.hpp"
#include "renderer/world/build.hpp"
#include "renderer/world/exposure.hpp"
#include "renderer/world/key_times.hpp"
#include "renderer/world/kinematics.hpp"
#include "renderer/world/planetshine.hpp"
#include "renderer/world/pose_age.hpp"
#include "renderer/world/row_state.hpp"
#include "renderer/world/view.hpp"

#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <thread>
#include <vector>

namespace obscura::renderer {
namespace {

/// Scratch memory of one thread, kept between rows so that nothing is allocated after the first.
struct Scratch {
    std::vector<RowState> rows;            ///< at the instants of the exposure, and unused ones
    std::vector<SweptBody> swept;          ///< over those instants
    std::optional<MovingLens> moving_lens; ///< with aberration
    const Projection* lens = nullptr;      ///< of the row begun last: moving_lens or the camera's
    std::vector<double> light;             ///< channels x pixels, in the tracer's units, sr
    std::vector<double> starlight;         ///< bands x pixels, W/m2
    std::vector<double> per_pixel;         ///< factor from irradiance to the requested quantity
    std::vector<NoiseSums> noise;          ///< per block of 16 pixels
    bool sunlight_only = true;             ///< of the row's tracer
    std::vector<double> variance;          ///< per pixel; 0: no samples
    std::vector<float> wing_row;
    std::vector<PointJob> point_jobs; ///< of a row that shares its points with no other
    BodyPoints points;
    std::vector<std::int32_t> candidates;
    RayCounts counts;
    WorkClock work;
    std::vector<SurfaceTiles::Pin> pins; ///< of all terrains, while a row is rendered
    DetailCounts detail;                 ///< of the row
    std::uint64_t frame = 0;             ///< see frame_key()
    RowTime measured{};                  ///< the exposure that `motion` belongs to
    double motion = 0;                   ///< see motion_px()
    /// The request and exposure that `rows` and `swept` are set up for; request 0: none.
    std::uint64_t set_up_for = 0;
    RowTime set_up_time{};
};

/// Small bodies of a frame whose rows all have the same exposure, as points of the image.
struct SharedPoints {
    std::optional<RowTime> time;  ///< of the rows; empty: each has its own
    std::vector<PointJob> jobs;   ///< in order of their instants
    std::vector<BodyPoints> done; ///< of each job
};

/// Data shared by the rows of one request (a row block).
struct RowBlock {
    std::uint64_t request = 0; ///< its number, from 1
    SharedPoints points;
    StarsInView stars;
    std::optional<SampleGridKernel> kernel; ///< of `grid`; empty: no shared samples
    SampleGrid grid;
    std::optional<WingMaps> wings; ///< empty: the PSF has none
    std::vector<RowTime> middles;  ///< scratch space of fill_wings()
};

/// Variance of pixels that have samples, even if all are equal: 0 means none. Any positive number.
constexpr double least_variance = std::numeric_limits<double>::min();

/// First samples of pixels of adaptive sampling where something moves: with fewer, too many of those that an
/// edge crosses during the exposure see only one side of it (measured by noise_estimate_test.cpp).
constexpr std::uint32_t least_moving_samples = 8;

/// Whether any body in the field, all of which is within `field_rad` of the boresight, is larger than pixels.
bool resolves_any(const RowState& row, double field_rad) {
    const double reach_rad = field_rad + 2 * length(row.beta) + row.reach_rad + 1e-6;
    return std::any_of(row.bodies.begin(), row.bodies.end(), [&](const BodyState& b) {
        if (b.targeted) return false;
        const Vec3 d = b.direction;
        return b.cos_cone < 0 ||
               std::atan2(std::hypot(d.x, d.y), d.z) <= reach_rad + std::asin(std::min(1.0, b.cone_sine));
    });
}

} // namespace

struct Renderer::Impl {
    class TracedLight;

    scene::Scene scene;
    RenderSettings settings;
    unsigned threads;
    std::unique_ptr<const Projection> lens;
    GaussianPsf gaussian_psf;
    std::unique_ptr<const Psf> psf; ///< null: the Gaussian
    std::vector<BuiltBody> bodies;
    std::vector<const SurfaceTiles*> terrains;        ///< tiles of the bodies, each once
    std::vector<std::unique_ptr<TileLoader>> loaders; ///< of those, unless rendering waits for tiles
    std::vector<Vec3> landmarks_m;                    ///< see landmark_points()
    PointSplatter splatter;
    std::vector<StrayMap> stray;
    double field_rad;             ///< largest angle of a pixel's centre to the boresight
    std::vector<double> sun_w_m2; ///< per band, at 1 au
    Lighting lighting;
    bool plain = true; ///< direct sunlight on grey surfaces: one channel is enough
    std::unique_ptr<const WingKernels> wing_kernels; ///< null: the PSF has no wings
    /// Raises the limit of TBB, one worker per core by default, to the number of threads.
    std::optional<tbb::global_control> more_threads;
    mutable tbb::task_arena arena;
    std::optional<WorkerObserver> observer; ///< with RenderSettings::enter_worker
    mutable tbb::enumerable_thread_specific<Scratch> scratch;
    /// Per thread that calls render().
    mutable tbb::enumerable_thread_specific<RowBlock> block_scratch;
    mutable std::atomic<std::uint64_t> requests{0};
    mutable std::atomic<std::uint64_t> rays_done{0};
    mutable std::atomic<std::uint64_t> samples_done{0};
    mutable std::atomic<std::uint64_t> surface_hits{0}, tiles_missed{0};
    mutable std::array<std::atomic<std::uint64_t>, 4> surface_coarser{};
    mutable WorkTotals work_done;

    Impl(scene::Scene s, RenderSettings r)
        : scene((validate(s), std::move(s))),
          settings(r),
          threads(r.threads > 0 ? r.threads : std::max(1u, std::thread::hardware_concurrency())),
          lens(scene::at_position(scene.camera.position, [&] { return make_projection(scene.camera); })),
          gaussian_psf(scene.camera.psf_sigma_px, scene.camera.pixel_aspect()),
          psf(scene::at_position(scene.camera.position,
                                 [&] { return Psf::make(scene.camera, scene.bands); })),
          bodies(build_bodies(scene)),
          landmarks_m(landmark_points(scene, bodies)),
          splatter(scene, bodies, *lens, gaussian_psf, psf.get(), r.seed),
          stray(read_stray_light(scene)),
          field_rad(lens->field_angle_rad(1)),
          arena(static_cast<int>(threads)) {
        for (const BuiltBody& body : bodies)
            if (const SurfaceTiles* tiles = body.shape->tiles();
                tiles != nullptr && std::find(terrains.begin(), terrains.end(), tiles) == terrains.end())
                terrains.push_back(tiles);
        if (!settings.wait_for_tiles)
            for (const SurfaceTiles* const tiles : terrains)
                loaders.push_back(
                    std::make_unique<TileLoader>(*tiles, TileLoader::Settings{settings.tiles_per_s}));
        if (!settings.wait_for_tiles)
            for (const BuiltBody& body : bodies)
                if (body.textures) body.textures->stop_waiting();
        if (settings.enter_worker) observer.emplace(arena, settings.enter_worker);
        if (threads > std::thread::hardware_concurrency())
            more_threads.emplace(tbb::global_control::max_allowed_parallelism, threads);
        settings.samples_per_pixel = std::max(1u, settings.samples_per_pixel);
        settings.max_instants = std::max(1u, settings.max_instants);
        settings.max_bounces = std::max(settings.max_bounces, scene.max_bounces);
        if (settings.max_bounces > 0) guide_bounces(bodies);
        for (const SpectralBand& band : scene.bands)
            sun_w_m2.push_back(sun_irradiance_w_m2(band) * scene.sun.irradiance_scale);
        lighting = make_lighting(scene, area_lights_of(bodies), sun_w_m2, settings.max_bounces);
        plain = settings.max_bounces == 0 && scene.lamps.empty() && !(psf && psf->chromatic()) &&
                std::all_of(bodies.begin(), bodies.end(), [](const BuiltBody& b) {
                    return b.colour.empty() && b.emission.empty() && (!b.textures || b.textures->grey());
                });
        if (psf && psf->wings_px() > 0)
            wing_kernels = std::make_unique<WingKernels>(*psf, plain ? 1 : scene.bands.size());
    }

    void add_detail(DetailCounts& counts) const {
        surface_hits.fetch_add(counts.hits, std::memory_order_relaxed);
        tiles_missed.fetch_add(counts.missed, std::memory_order_relaxed);
        for (std::size_t k = 0; k < counts.coarser.size(); ++k)
            surface_coarser[k].fetch_add(counts.coarser[k], std::memory_order_relaxed);
        counts = {};
    }
    /// Calls `do_row(r, scratch)` for rows [0, rows) on the workers; false when cancelled. Their time belongs
    /// to `part` where no lap assigns it.
    /// `frame`: see frame_key().
    template<typename DoRow>
    bool for_rows(RenderPart part, std::int32_t rows, std::uint64_t frame, const std::atomic<bool>* cancel,
                  const DoRow& do_row) const;
    /// What all requests of a frame have in common, for the tiles that it shows; 0: those that are there.
    [[nodiscard]] std::uint64_t frame_key(const RenderRequest& request) const {
        if (loaders.empty()) return 0;
        const auto mid = static_cast<std::uint64_t>(request.common_mid ? request.common_mid->ns : 0);
        return (request.frame_id * 0x9e3779b97f4a7c15ull ^ mid * 0xc2b2ae3d27d4eb4full) | 1;
    }
    /// Tells the loaders where the next second's frames will be seen from.
    void predict_views(const RenderRequest& request) const;
    /// Irradiance of the Sun at the camera over that at 1 au.
    [[nodiscard]] double sun_at_camera(const RowState& row) const {
        const double distance = length(row.sun_m - row.camera.position_m) / astronomical_unit_m;
        return scene.sun.irradiance_scale / (distance * distance);
    }
    /// Instants at which a row is rendered.
    [[nodiscard]] Exposure exposure(const RowTime& row, Scratch& s) const {
        if (settings.max_instants > 1 && s.measured != row) {
            s.measured = row;
            s.motion = motion_px(scene, bodies, *lens, splatter.reach_px(), row);
        }
        return Exposure::of(row, s.motion, settings.max_instants);
    }
    /// Least number of samples of a pixel, see begin_row().
    [[nodiscard]] std::uint32_t least_samples_of(const Exposure& when) const {
        return settings.target_error > 0 && when.instants > 1 ? least_moving_samples : 1;
    }
    /// Sets the lens for a row.
    void set_lens(Vec3 beta, Scratch& s) const {
        s.lens = lens.get();
        if (length(beta) > 0) s.lens = &s.moving_lens.emplace(*lens, beta);
    }
    /// Sets the lens and state `i` of Scratch::rows.
    RowState& begin_row(double time_s, Scratch& s, std::size_t i = 0, std::uint32_t least_samples = 1) const {
        s.set_up_for = 0;
        if (s.rows.size() <= i) s.rows.resize(i + 1);
        RowState& row = s.rows[i];
        row.beta = camera_beta(scene, bodies, time_s);
        set_lens(row.beta, s);
        set_row_state(scene, bodies, *s.lens, sample_reach_px(),
                      std::max(settings.samples_per_pixel, least_samples), time_s, row);
        if (!terrains.empty())
            for (BodyState& body : row.bodies) {
                if (body.detail_view() == nullptr) continue;
                body.detail.wait = settings.wait_for_tiles;
                body.detail.version = body.shape->tiles()->version_of(s.frame);
                body.detail.counts = &s.detail;
            }
        if (lighting.max_bounces > 0 && lighting.has_sun()) find_planetshine(row);
        s.work.lap(RenderPart::setup);
        return row;
    }
    /// Sets up Scratch::rows and Scratch::swept at the instants of a row, unless they are those of the row of
    /// the same request before: the rows of a global shutter are exposed together.
    void begin_rows(std::uint64_t request, const Exposure& when, Scratch& s) const {
        if (s.set_up_for == request && s.set_up_time == when.row) return;
        const std::uint32_t least_samples = least_samples_of(when);
        for (std::uint32_t i = 0; i < when.instants; ++i)
            begin_row(when.time_s(i), s, i, least_samples);
        join_instants({s.rows.data(), when.instants}, s.swept);
        s.set_up_for = request;
        s.set_up_time = when.row;
    }
    /// Calls `use(tracer)` with the tracer for the scene: direct sunlight only, or paths.
    template<typename Use>
    void with_tracer(const Instants& instants, Scratch& s, const Use& use) const;
    /// Whether a row takes the sample grid of its frame: its only instant is that of the frame's rows.
    /// Depends on the row alone, whatever other rows the request has.
    [[nodiscard]] bool shares_samples(const RenderRequest& request, const RowTime& row, Scratch& s) const;
    bool fill_sample_grid(const RenderRequest& request, const std::atomic<bool>* cancel,
                          RowBlock& rows) const;
    /// Traces the small bodies that the request's rows share; false when cancelled.
    bool fill_points(const RenderRequest& request, const std::atomic<bool>* cancel, RowBlock& rows) const;
    /// Adds the small bodies at instant `instant` of the row's exposure.
    void splat_bodies(const RenderRequest& request, const RowBlock& rows, const SplatTarget& target,
                      std::uint32_t instant, Tracer& tracer, Scratch& s) const;
    /// Makes the wings of the request's rows ready; false when cancelled.
    bool fill_wings(const RenderRequest& request, const std::atomic<bool>* cancel, RowBlock& rows) const;
    bool fill_wing_map(const WingMaps::Needed& needed, const std::atomic<bool>* cancel) const;
    void render_row(const RenderRequest& request, const RowBlock& rows, std::int32_t r,
                    std::span<float> irradiance, Scratch& s) const;
    /// Adds the light of the row's pixel samples.
    void trace_pixels(const RenderRequest& request, std::int32_t y, const RowBlock& rows,
                      const Instants& instants, Tracer& tracer, Scratch& s) const;
    /// Estimates the variance of a row from Scratch::noise and what Scratch::variance has of the grid.
    void estimate_variance(const RenderRequest& request, Scratch& s, std::span<float> variance) const;
    [[nodiscard]] Sampling sampling(const RenderRequest& request) const {
        return {settings.seed, request.frame_id, settings.max_samples_per_pixel, settings.target_error};
    }
    /// Largest displacement of a camera sample by the PSF, along an axis.
    [[nodiscard]] double sample_reach_px() const { return psf ? psf->reach_px() : gaussian_psf.reach_px(); }
    /// Largest angle across a square of a pixel's area, for the footprints of rays.
    [[nodiscard]] double pixel_width_rad() const {
        return lens->pixel_angle_rad() * std::sqrt(scene.camera.pixel_flattening());
    }
};

template<typename DoRow>
bool Renderer::Impl::for_rows(RenderPart part, std::int32_t row_count, std::uint64_t frame,
                              const std::atomic<bool>* cancel, const DoRow& do_row) const {
    std::atomic<bool> complete{true};
    const auto do_rows = [&](std::int32_t begin, std::int32_t end, Scratch& local) {
        const FlushDenormals flush;
        local.work.start(part);
        for (std::int32_t r = begin; r != end; ++r) {
            if (cancel != nullptr && cancel->load(std::memory_order_relaxed)) {
                complete.store(false, std::memory_order_relaxed);
                break;
            }
            if (local.frame != frame) local.set_up_for = 0;
            local.frame = frame;
            local.pins.clear();
            for (const SurfaceTiles* const tiles : terrains)
                local.pins.push_back(tiles->pin());
            do_row(r, local);
            local.work.row_done();
            if (!terrains.empty()) add_detail(local.detail);
            // Update after each row: the supervisor reads these as watchdog progress.
            rays_done.fetch_add(local.counts.rays, std::memory_order_relaxed);
            samples_done.fetch_add(local.counts.samples, std::memory_order_relaxed);
            local.counts = {};
        }
        local.pins.clear();
        local.work.stop(work_done);
    };
#ifdef __SANITIZE_THREAD__
    // ThreadSanitizer does not understand TBB: it would report every fork and join, or, with those
    // suppressed, no race between rows. Plain threads let it check the rows.
    std::vector<std::jthread> workers;
    const auto first_row_of = [&](unsigned worker) {
        return static_cast<std::int32_t>(static_cast<std::int64_t>(row_count) * worker / threads);
    };
    for (unsigned i = 0; i < threads; ++i)
        workers.emplace_back([&, i] {
            if (settings.enter_worker) settings.enter_worker();
            Scratch own;
            do_rows(first_row_of(i), first_row_of(i + 1), own);
        });
    workers.clear();
#else
    arena.execute([&] {
        tbb::parallel_for(tbb::blocked_range<std::int32_t>(0, row_count),
                          [&](const tbb::blocked_range<std::int32_t>& rows) {
                              do_rows(rows.begin(), rows.end(), scratch.local());
                          });
    });
#endif
    return complete.load();
}

template<typename Use>
void Renderer::Impl::with_tracer(const Instants& instants, Scratch& s, const Use& use) const {
    const double ray_width_rad = pixel_width_rad() / std::sqrt(settings.samples_per_pixel);
    if (plain) {
        Tracer tracer(instants, scene.sun, s.counts);
        tracer.set_ray_width(ray_width_rad);
        use(tracer);
    } else {
        PathTracer tracer(instants, lighting, scene.sun, s.counts);
        tracer.set_ray_width(ray_width_rad);
        use(tracer);
    }
}

bool Renderer::Impl::shares_samples(const RenderRequest& request, const RowTime& row, Scratch& s) const {
    // Share samples only at <= 2 spp: a higher count is an explicit request.
    return settings.target_error > 0 && settings.samples_per_pixel <= 2 && !psf &&
           request.common_mid == row.mid() && SampleGridKernel::fits(gaussian_psf) &&
           exposure(row, s).instants == 1;
}

void Renderer::Impl::predict_views(const RenderRequest& request) const {
    if (request.row_times.empty()) return;
    constexpr double ahead_s = 1;
    const double time_s = to_seconds(request.row_times.front().mid().ns) + ahead_s;
    const Pose camera = camera_pose(scene, bodies, time_s);
    const Mat3 inertial_from_camera = to_matrix(camera.orientation);
    for (std::size_t k = 0; k < terrains.size(); ++k)
        for (std::size_t i = 0; i < bodies.size(); ++i) {
            if (bodies[i].shape->tiles() != terrains[k]) continue;
            const Pose pose = seen_pose(scene, bodies, i, camera.position_m, time_s);
            const Mat3 from_inertial = transposed(to_matrix(pose.orientation));
            // A tenth of the field more on each side.
            loaders[k]->predict({from_inertial * (camera.position_m - pose.position_m),
                                 from_inertial * (inertial_from_camera * Vec3{0, 0, 1}), 1.1 * field_rad,
                                 terrain_cell_px * lens->pixel_angle_rad()});
            break;
        }
}

bool Renderer::Impl::fill_sample_grid(const RenderRequest& request, const std::atomic<bool>* cancel,
                                      RowBlock& rows) const {
    rows.kernel.reset();
    Scratch& own = scratch.local();
    if (std::none_of(request.row_times.begin(), request.row_times.end(),
                     [&](const RowTime& row) { return shares_samples(request, row, own); }))
        return true;
    rows.kernel.emplace(gaussian_psf, settings.seed, request.frame_id);
    SampleGrid& grid = rows.grid;
    grid.reset(request.window, request.first_row, request.rows, plain ? 1 : scene.bands.size(),
               rows.kernel->reach);
    const double time_s = to_seconds(request.common_mid->ns);
    return for_rows(
        RenderPart::grid, grid.height(), frame_key(request), cancel, [&](std::int32_t r, Scratch& s) {
            const RowState& row = begin_row(time_s, s);
            if (!resolves_any(row, field_rad)) return;
            with_tracer(row, s, [&](Tracer& tracer) {
                const Sampling how = sampling(request);
                BlockTracer blocks(*s.lens, gaussian_psf, psf.get(), how, row, {}, tracer, s.candidates);
                const std::int32_t first = BlockTracer::block_of(grid.first_x());
                for (std::int32_t block = 0; block < grid.width() / packet_size; ++block)
                    blocks.trace_grid(first + block, grid.first_y() + r, *rows.kernel, grid);
            });
        });
}

bool Renderer::Impl::fill_points(const RenderRequest& request, const std::atomic<bool>* cancel,
                                 RowBlock& rows) const {
    SharedPoints& shared = rows.points;
    shared.jobs.clear();
    shared.time.reset();
    const auto times = request.row_times;
    if (times.empty() || request.common_mid != times.front().mid() ||
        std::any_of(times.begin(), times.end(), [&](const RowTime& t) { return t != times.front(); }))
        return true;
    shared.time = times.front();
    Scratch& own = scratch.local();
    const Exposure when = exposure(times.front(), own);
    const std::uint32_t least_samples = least_samples_of(when);
    const auto view = [&](const RowState& row, Scratch& s) {
        return PointView{request.window, request.window.y + request.first_row,
                         request.rows,   request.frame_id,
                         false,          row,
                         *s.lens,        s.candidates};
    };
    for (std::uint32_t i = 0; i < when.instants; ++i) {
        const RowState& row = begin_row(when.time_s(i), own, 0, least_samples);
        with_tracer(row, own, [&](const Tracer& tracer) {
            splatter.plan_points(view(row, own), i, when.instants, tracer, shared.jobs);
        });
    }
    if (shared.done.size() < shared.jobs.size()) shared.done.resize(shared.jobs.size());
    return for_rows(RenderPart::points, static_cast<std::int32_t>(shared.jobs.size()), frame_key(request),
                    cancel, [&](std::int32_t j, Scratch& s) {
                        const PointJob& job = shared.jobs[static_cast<std::size_t>(j)];
                        const RowState& row = begin_row(when.time_s(job.instant), s, 0, least_samples);
                        with_tracer(row, s, [&](Tracer& tracer) {
                            splatter.trace_points(view(row, s), job, tracer,
                                                  shared.done[static_cast<std::size_t>(j)]);
                        });
                    });
}

void Renderer::Impl::splat_bodies(const RenderRequest& request, const RowBlock& rows,
                                  const SplatTarget& target, std::uint32_t instant, Tracer& tracer,
                                  Scratch& s) const {
    if (rows.points.time) {
        const std::vector<PointJob>& jobs = rows.points.jobs;
        const auto first = std::partition_point(jobs.begin(), jobs.end(),
                                                [&](const PointJob& job) { return job.instant < instant; });
        for (auto job = first; job != jobs.end() && job->instant == instant; ++job)
            splatter.splat_body(target, rows.points.done[static_cast<std::size_t>(job - jobs.begin())]);
        return;
    }
    const auto r = static_cast<std::size_t>(target.y - request.window.y - request.first_row);
    const bool alone = request.common_mid != request.row_times[r].mid();
    const PointView view{request.window, target.y,   1,       request.frame_id,
                         alone,          target.row, *s.lens, s.candidates};
    s.point_jobs.clear();
    splatter.plan_points(view, instant, target.instants, tracer, s.point_jobs);
    for (const PointJob& job : s.point_jobs) {
        splatter.trace_points(view, job, tracer, s.points);
        splatter.splat_body(target, s.points);
    }
}

bool Renderer::Impl::fill_wings(const RenderRequest& request, const std::atomic<bool>* cancel,
                                RowBlock& rows) const {
    if (!wing_kernels) return true;
    if (!rows.wings)
        rows.wings.emplace(*psf, *wing_kernels,
                           KeyTimes(scene, bodies, *lens, splatter.reach_px(), WingMaps::spacing_px(*psf)));
    std::span<const RowTime> times = request.row_times;
    if (settings.max_instants == 1) {
        rows.middles.clear();
        for (const RowTime& t : times)
            rows.middles.push_back({t.mid(), t.mid()});
        times = rows.middles;
    }
    const std::span<const WingMaps::Needed> needed =
        rows.wings->find(request.frame_id, times, request.window.y + request.first_row, request.window.x,
                         request.window.width);
    return std::all_of(needed.begin(), needed.end(),
                       [&](const WingMaps::Needed& n) { return fill_wing_map(n, cancel); });
}

bool Renderer::Impl::fill_wing_map(const WingMaps::Needed& needed, const std::atomic<bool>* cancel) const {
    WingMap& map = *needed.map;
    const double time_s = to_seconds(map.time().ns);
    if (!map.has_bodies()) {
        Scratch& s = scratch.local();
        const RowState& row = begin_row(time_s, s);
        map.set_bodies(*s.lens, row);
    }
    // Calls `use(job, view)` for every job, with the scene at the map's time.
    const auto trace = [&](std::int32_t jobs, const auto& use) {
        return for_rows(RenderPart::wings, jobs, 0, cancel, [&](std::int32_t i, Scratch& s) {
            const RowState& row = begin_row(time_s, s);
            with_tracer(row, s, [&](Tracer& tracer) {
                use(i, WingMap::View{*s.lens, row, tracer, s.candidates, settings.seed});
            });
        });
    };
    const auto each = [&](std::span<const WingMap::Job> jobs, const auto& use) {
        return for_rows(RenderPart::wings, static_cast<std::int32_t>(jobs.size()), 0, cancel,
                        [&](std::int32_t i, Scratch& s) { use(jobs[static_cast<std::size_t>(i)], s); });
    };
    if (!map.has_points()) {
        if (!trace(map.point_jobs(),
                   [&](std::int32_t i, const WingMap::View& view) { map.trace_points(i, view); }))
            return false;
        map.sort_points();
    }
    map.plan(needed.first_y, needed.last_y);
    if (!trace(static_cast<std::int32_t>(map.cell_jobs().size()),
               [&](std::int32_t i, const WingMap::View& view) {
                   map.trace_cells(map.cell_jobs()[static_cast<std::size_t>(i)], view);
               }))
        return false;
    if (!each(map.source_jobs(), [&](WingMap::Job job, Scratch&) { map.gather(job); })) return false;
    const std::span<const WingMap::Job> results = map.result_jobs();
    if (!each(results, [&](WingMap::Job job, Scratch&) { map.convolve(job); })) return false;
    // Jobs are in the order of their levels; each needs the one above.
    for (auto end = results.end(); end != results.begin();) {
        const auto begin = std::find_if(
            results.begin(), end, [&](const WingMap::Job& job) { return job.level == (end - 1)->level; });
        if (!each({begin, end}, [&](WingMap::Job job, Scratch& s) { map.add_level_above(job, s.wing_row); }))
            return false;
        end = begin;
    }
    return true;
}

void Renderer::Impl::trace_pixels(const RenderRequest& request, std::int32_t y, const RowBlock& rows,
                                  const Instants& instants, Tracer& tracer, Scratch& s) const {
    if (std::none_of(instants.states().begin(), instants.states().end(),
                     [&](const RowState& row) { return resolves_any(row, field_rad); }))
        return;
    const auto width = static_cast<std::size_t>(request.window.width);
    const Sampling how = sampling(request);
    s.sunlight_only = tracer.sunlight_only();
    BlockTracer blocks(instants.one() ? *s.lens : *lens, gaussian_psf, psf.get(), how, instants, s.swept,
                       tracer, s.candidates);
    const bool shared =
        rows.kernel &&
        shares_samples(request,
                       request.row_times[static_cast<std::size_t>(y - request.window.y - request.first_row)],
                       s);
    const std::int32_t last = BlockTracer::block_of(request.window.x + request.window.width - 1);
    const std::int32_t first = BlockTracer::block_of(request.window.x);
    for (std::int32_t block = first; block <= last; ++block) {
        BlockResult result;
        NoiseSums* const noise =
            request.variance.empty() ? nullptr : &s.noise[static_cast<std::size_t>(block - first)];
        if (!blocks.trace(block, y, result, noise, shared ? &*rows.kernel : nullptr,
                          shared ? &rows.grid : nullptr))
            continue;
        for (int i = 0; i < packet_size; ++i) {
            const std::int32_t column = block * packet_size + i - request.window.x;
            if (!result.covered[i] || column < 0 || column >= request.window.width) continue;
            const auto pixel = static_cast<std::size_t>(column);
            for (std::size_t c = 0; c < tracer.channels(); ++c)
                s.light[c * width + pixel] += result.mean[c][i];
            const std::size_t at =
                static_cast<std::size_t>(y - request.window.y - request.first_row) * width + pixel;
            if (!request.samples.empty()) request.samples[at] += static_cast<float>(result.samples[i]);
            // From the grid; the variance of a pixel's own samples follows when all blocks are done.
            if (noise != nullptr && noise->count(i) == 0)
                s.variance[pixel] = std::max(result.variance[i], least_variance);
        }
    }
}

void Renderer::Impl::estimate_variance(const RenderRequest& request, Scratch& s,
                                       std::span<float> variance) const {
    std::fill(variance.begin(), variance.end(), 0.0F);
    const double unit =
        plain ? std::accumulate(sun_w_m2.begin(), sun_w_m2.end(), 0.0) / static_cast<double>(sun_w_m2.size())
              : 1;
    const std::int32_t first = BlockTracer::block_of(request.window.x);
    const auto width = static_cast<std::int32_t>(variance.size());
    for (std::size_t b = 0; b < s.noise.size(); ++b) {
        Doubles own;
        s.noise[b].variance(s.sunlight_only, own);
        for (int i = 0; i < packet_size; ++i) {
            const std::int32_t column =
                (first + static_cast<std::int32_t>(b)) * packet_size + i - request.window.x;
            if (column < 0 || column >= width || s.noise[b].count(i) == 0) continue;
            const auto pixel = static_cast<std::size_t>(column);
            s.variance[pixel] = std::max(own[i], least_variance);
        }
    }
    const std::size_t channels = s.light.size() / variance.size();
    for (std::size_t x = 0; x < variance.size(); ++x) {
        if (!(s.variance[x] > 0)) continue;
        double value = 0;
        for (std::size_t c = 0; c < channels; ++c)
            value += s.light[c * variance.size() + x] / static_cast<double>(channels);
        // No less than the rounding of the image to float, nor than a float can hold.
        const double scale = unit * s.per_pixel[x];
        const double rounded = 0x1p-24 * value;
        variance[x] =
            static_cast<float>(std::max(std::max(s.variance[x], rounded * rounded / 12) * scale * scale,
                                        static_cast<double>(std::numeric_limits<float>::min())));
    }
}

void Renderer::Impl::render_row(const RenderRequest& request, const RowBlock& rows, std::int32_t r,
                                std::span<float> irradiance, Scratch& s) const {
    const auto width = static_cast<std::size_t>(request.window.width);
    const std::int32_t y = request.window.y + request.first_row + r;
    const Exposure when = exposure(request.row_times[static_cast<std::size_t>(r)], s);
    s.starlight.assign(width * scene.bands.size(), 0);
    const auto row_of = [&](std::span<float> plane) {
        return plane.empty() ? plane : plane.subspan(static_cast<std::size_t>(r) * width, width);
    };
    std::fill(row_of(request.samples).begin(), row_of(request.samples).end(), 0.0F);
    if (!request.variance.empty()) {
        s.variance.assign(width, 0);
        s.noise.resize(
            static_cast<std::size_t>(BlockTracer::block_of(request.window.x + request.window.width - 1) -
                                     BlockTracer::block_of(request.window.x) + 1));
        for (NoiseSums& noise : s.noise)
            noise.reset();
    }
    s.light.assign(width * (plain ? 1 : scene.bands.size()), 0);
    begin_rows(rows.request, when, s);
    const std::span states(s.rows.data(), when.instants);
    const Instants instants(states);
    s.work.row_set_up(when.instants);
    with_tracer(instants, s, [&](Tracer& tracer) { trace_pixels(request, y, rows, instants, tracer, s); });
    s.work.lap(RenderPart::sampling);
    for (std::uint32_t i = 0; i < when.instants; ++i) {
        set_lens(states[i].beta, s);
        with_tracer(states[i], s, [&](Tracer& tracer) {
            const StarObserver seen_from = star_observer(scene, states[i].camera.position_m, when.time_s(i));
            const SplatTarget target{request.window, y,       when.instants, states[i],   seen_from,
                                     when.time_s(i), *s.lens, s.light,       s.starlight, s.candidates};
            splat_bodies(request, rows, target, i, tracer, s);
            splatter.splat_stars(target, rows.stars.stars, rows.stars.in_row(static_cast<std::size_t>(r)),
                                 tracer);
            splatter.splat_sky(target, tracer);
            s.work.lap(RenderPart::points);
        });
    }
    if (rows.wings) {
        rows.wings->add(static_cast<std::size_t>(r), s.light, s.wing_row);
        s.work.lap(RenderPart::wings);
    }
    s.per_pixel.assign(width, 1);
    if (scene.quantity == scene::Quantity::radiance)
        for (std::size_t x = 0; x < width; ++x) {
            const double solid_angle_sr = lens->solid_angle_sr(request.window.x + static_cast<double>(x), y);
            s.per_pixel[x] = solid_angle_sr > 0 ? 1 / solid_angle_sr : 0;
        }
    if (!request.variance.empty()) estimate_variance(request, s, row_of(request.variance));
    for (const StrayMap& map : stray)
        map.add(request.window.x, y, sun_at_camera(states.back()), scene.bands.size(), s.starlight);
    for (std::size_t b = 0; b < scene.bands.size(); ++b) {
        float* out = irradiance.data() +
                     (b * static_cast<std::size_t>(request.rows) + static_cast<std::size_t>(r)) * width;
        const double* light = s.light.data() + (plain ? 0 : b * width);
        const double unit = plain ? sun_w_m2[b] : 1;
        for (std::size_t x = 0; x < width; ++x)
            out[x] = static_cast<float>((light[x] * unit + s.starlight[b * width + x]) * s.per_pixel[x]);
    }
}

Renderer::Renderer(scene::Scene scene, RenderSettings settings)
    : impl_(std::make_unique<Impl>(std::move(scene), settings)) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

const scene::Scene& Renderer::scene() const noexcept {
    return impl_->scene;
}

std::size_t Renderer::band_count() const noexcept {
    return impl_->scene.bands.size();
}

bool Renderer::render(const RenderRequest& request, std::span<float> irradiance,
                      const std::atomic<bool>* cancel) const {
    assert(irradiance.size() == band_count() * static_cast<std::size_t>(request.rows) *
                                    static_cast<std::size_t>(request.window.width));
    assert(request.rows >= 0 && request.row_times.size() == static_cast<std::size_t>(request.rows));
    RowBlock& rows = impl_->block_scratch.local();
    rows.request = impl_->requests.fetch_add(1, std::memory_order_relaxed) + 1;
    if (!impl_->loaders.empty() && request.first_row == 0) {
        for (const SurfaceTiles* const tiles : impl_->terrains)
            tiles->begin_frame(impl_->frame_key(request));
        impl_->predict_views(request);
    }
    impl_->splatter.star_rows().assign(request.row_times, request.window,
                                       request.window.y + request.first_row, rows.stars);
    return impl_->fill_sample_grid(request, cancel, rows) && impl_->fill_points(request, cancel, rows) &&
           impl_->fill_wings(request, cancel, rows) &&
           impl_->for_rows(RenderPart::rest, request.rows, impl_->frame_key(request), cancel,
                           [&](std::int32_t r, Scratch& scratch) {
                               impl_->render_row(request, rows, r, irradiance, scratch);
                           });
}

bool Renderer::render_aovs(const RenderRequest& request, std::span<float> aovs,
                           const std::atomic<bool>* cancel) const {
    const auto width = static_cast<std::size_t>(request.window.width);
    const std::size_t plane = static_cast<std::size_t>(request.rows) * width;
    assert(aovs.size() == aov_count * plane);
    return impl_->for_rows(
        RenderPart::rest, request.rows, impl_->frame_key(request), cancel, [&](std::int32_t r, Scratch& s) {
            const double time_s = to_seconds(request.row_times[static_cast<std::size_t>(r)].mid().ns);
            const RowState& row = impl_->begin_row(time_s, s);
            trace_aovs(*s.lens, row, request.window.x, request.window.y + request.first_row + r,
                       request.window.width, impl_->pixel_width_rad(), s.candidates,
                       aovs.data() + static_cast<std::size_t>(r) * width, plane);
        });
}

View Renderer::view(Time t) const {
    Scratch s;
    const RowState& row = impl_->begin_row(to_seconds(t.ns), s);
    const RowTime time{t, t};
    StarsInView stars;
    impl_->splatter.star_rows().find({&time, 1}, stars);
    return view_of(impl_->scene, row, *s.lens, stars.stars, stars.observer);
}

double Renderer::image_motion_px(const RowTime& span) const noexcept {
    return renderer::motion_px(impl_->scene, impl_->bodies, *impl_->lens, impl_->splatter.reach_px(), span);
}

double Renderer::image_change_px(const GroundTruth& from, const GroundTruth& to) const noexcept {
    return change_px(impl_->scene, impl_->bodies, *impl_->lens, impl_->splatter.reach_px(), from, to);
}

void Renderer::fill_truth(Time t, GroundTruth& truth) const noexcept {
    const double time_s = to_seconds(t.ns);
    truth.mid_exposure = t;
    truth.camera = camera_pose(impl_->scene, impl_->bodies, time_s);
    truth.camera_pose_age_s = camera_pose_age_s(impl_->scene, impl_->bodies, time_s);
    truth.sun_position_m = impl_->scene.sun.position_at(time_s);
    truth.seed = impl_->settings.seed;
    truth.intrinsics = impl_->scene.camera.intrinsics();
    const auto& bodies = impl_->scene.bodies;
    truth.body_count = static_cast<std::uint32_t>(std::min(bodies.size(), max_truth_bodies));
    for (std::uint32_t i = 0; i < truth.body_count; ++i) {
        BodyTruth& body = truth.bodies[i];
        body.name.fill('\0');
        const std::string& name = bodies[i].name;
        std::copy_n(name.begin(), std::min(name.size(), body.name.size() - 1), body.name.begin());
        body.pose = seen_pose(impl_->scene, impl_->bodies, i, truth.camera.position_m, time_s);
        body.pose_age_s = body_pose_age_s(impl_->bodies, i, time_s);
    }
}

/// Traces as frames are traced, one instant after another.
class Renderer::Impl::TracedLight final : public BodyLight {
public:
    TracedLight(const Impl& impl, Scratch& scratch) : impl_(impl), scratch_(scratch) {}

    [[nodiscard]] BandLight irradiance(std::size_t body, double time_s, const Region& sensor) override {
        return traced(time_s, [&](const RowState& row, Tracer& tracer, BandLight& light) {
            trace_irradiance(row, static_cast<std::int32_t>(body), *scratch_.lens, sensor, tracer,
                             scratch_.candidates, light);
        });
    }
    [[nodiscard]] BandLight radiance(std::size_t body, double time_s, Vec3 direction) override {
        return traced(time_s, [&](const RowState& row, Tracer& tracer, BandLight& light) {
            trace_radiance(row, static_cast<std::int32_t>(body), direction, impl_.pixel_width_rad(), tracer,
                           scratch_.candidates, light);
        });
    }

private:
    /// Calls `trace(row, tracer, light)`, whose light is in the channels and the unit of the tracer.
    template<typename Trace>
    BandLight traced(double time_s, const Trace& trace) {
        if (time_s != time_s_) impl_.begin_row(time_s, scratch_);
        time_s_ = time_s;
        BandLight light{};
        impl_.with_tracer(scratch_.rows[0], scratch_,
                          [&](Tracer& tracer) { trace(scratch_.rows[0], tracer, light); });
        if (impl_.plain) {
            const double per_sun = light[0];
            for (std::size_t b = 0; b < impl_.sun_w_m2.size(); ++b)
                light[b] = per_sun * impl_.sun_w_m2[b];
        }
        return light;
    }

    const Impl& impl_;
    Scratch& scratch_;
    double time_s_ = std::numeric_limits<double>::quiet_NaN(); ///< of the first row state
};

void Renderer::list_truth(const TruthRequest& request, SceneTruth& truth) const {
    StarsInView& in_view = impl_->block_scratch.local().stars;
    impl_->splatter.star_rows().find(request.rows, in_view);
    Impl::TracedLight light(*impl_, impl_->scratch.local());
    const TruthScene scene{impl_->scene,
                           impl_->bodies,
                           *impl_->lens,
                           impl_->gaussian_psf,
                           impl_->psf.get(),
                           impl_->landmarks_m,
                           in_view.stars,
                           impl_->splatter.sky(),
                           impl_->sun_w_m2,
                           impl_->settings.max_instants,
                           impl_->splatter.reach_px(),
                           &light};
    renderer::list_truth(scene, request, truth);
}

std::uint64_t Renderer::rays_traced() const noexcept {
    return impl_->rays_done.load(std::memory_order_relaxed);
}

std::uint64_t Renderer::samples_taken() const noexcept {
    return impl_->samples_done.load(std::memory_order_relaxed);
}

RenderWork Renderer::work() const noexcept {
    RenderWork work = impl_->work_done.read();
    work.rays = rays_traced();
    work.samples = samples_taken();
    work.surface_hits = impl_->surface_hits.load(std::memory_order_relaxed);
    work.tiles_missed = impl_->tiles_missed.load(std::memory_order_relaxed);
    for (const BuiltBody& body : impl_->bodies)
        if (body.textures) work.tiles_missed += body.textures->missed_tiles();
    for (std::size_t k = 0; k < work.surface_coarser.size(); ++k)
        work.surface_coarser[k] = impl_->surface_coarser[k].load(std::memory_order_relaxed);
    return work;
}

} // namespace obscura::renderer
