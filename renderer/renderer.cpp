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
#include "renderer/integrators/ray_query.hpp"
#include "renderer/integrators/sample_grid.hpp"
#include "renderer/integrators/sparse_grid.hpp"
#include "renderer/integrators/tracer.hpp"
#include "renderer/integrators/wing_maps.hpp"
#include "renderer/lights/lighting.hpp"
#include "renderer/lights/spectrum.hpp"
#include "renderer/packets/sampler.hpp"
#include "renderer/planets/sun_visibility.hpp"
#include "renderer/planets/surface_tiles.hpp"
#include "renderer/planets/tile_loader.hpp"
#include "renderer/registries/shape_cache.hpp"
#include "renderer/reprojection/kept_image.hpp"
#include "renderer/reprojection/motion_grid.hpp"
#include "renderer/reprojection/resample.hpp"
#include "renderer/scene/position.hpp"
#include "renderer/truth/body_light.hpp"
#include "renderer/truth/landmarks.hpp"
#include "renderer/truth/overlay.hpp"
#include "renderer/truth/row_states.hpp"
#include "renderer/truth/scene_truth.hpp"
#include "renderer/work_clock.hpp"
#include "renderer/worker_threads.hpp"
#include "renderer/world/build.hpp"
#include "renderer/world/exposure.hpp"
#include "renderer/world/key_times.hpp"
#include "renderer/world/kinematics.hpp"
#include "renderer/world/lamp_change.hpp"
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
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <exception>
#include <limits>
#include <mutex>
#include <numeric>
#include <optional>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

namespace obscura::renderer {
namespace {

/// States of the scene at the instants of a row.
struct RowSetUp {
    std::vector<RowState> rows;   ///< and unused ones
    std::vector<SweptBody> swept; ///< over those instants
    /// The request and exposure that they are set up for; request 0: none.
    std::uint64_t request = 0;
    RowTime time{};
    std::uint32_t instants = 0;
};

/// Scratch memory of one thread, kept between rows so that nothing is allocated after the first.
struct Scratch {
    RowSetUp whole;  ///< at the instants of the exposure
    RowSetUp fewer;  ///< at those of a level with fewer
    RowSetUp middle; ///< at the middle of the exposure, for what is kept
    MotionGrid::Row motion_of_row;
    std::optional<MovingLens> moving_lens;          ///< with aberration
    const Projection* lens = nullptr;               ///< of the row begun last: moving_lens or the camera's
    std::vector<double> light;                      ///< channels x pixels, in the tracer's units, sr
    std::vector<double> starlight;                  ///< bands x pixels, W/m2
    std::vector<double> per_pixel;                  ///< factor from irradiance to the requested quantity
    std::vector<double> variance;                   ///< per pixel; 0: no samples, and between rows
    std::size_t first_sampled = 0, end_sampled = 0; ///< pixels that may have some
    std::vector<float> wing_row;
    std::vector<PointJob> point_jobs; ///< of a row that shares its points with no other
    BodyPoints points;
    std::vector<std::int32_t> candidates;
    RayCounts counts;
    WorkClock work;
    std::vector<SurfaceTiles::Pin> pins;      ///< of all terrains, while a row is rendered
    std::vector<std::uint64_t> tile_versions; ///< of the bodies, for the truth of a frame
    DetailCounts detail;                      ///< of the row
    std::uint64_t frame = 0;                  ///< see frame_key()
    bool waits = false;                       ///< for tiles, whatever the settings
    RowTime measured{};                       ///< the exposure that `motion` belongs to
    double motion = 0;                        ///< see motion_px()
    std::int32_t row = 0;                     ///< of the request, that is being rendered

    /// `count` columns from `first` on, of a row of `width`, have samples.
    void add_sampled(std::int32_t first, std::int32_t count, std::int32_t width) {
        first_sampled = std::min(first_sampled, static_cast<std::size_t>(std::max(first, 0)));
        end_sampled = std::max(end_sampled, static_cast<std::size_t>(std::min(first + count, width)));
    }
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
    std::vector<std::uint8_t> grid_filled; ///< by its rows
    std::array<SparseGrid, 3> sparse;      ///< from QualityLevel::grid on
    std::array<bool, 3> sparse_begun{};    ///< those have been reset for this frame
    std::vector<std::int32_t> grid_jobs;   ///< rows of a grid to be filled
    std::uint64_t kept_by = 0;             ///< number of the renderer of kept samples
    bool kept = false;                     ///< the samples belong to a frame that has begun
    std::optional<WingMaps> wings;         ///< empty: the PSF has none
    std::vector<RowTime> middles;          ///< scratch space of fill_wings()
    /// Ends rows early: of requests none of whose rows is used if it becomes true.
    const std::atomic<bool>* cancel = nullptr;
};

} // namespace

struct FrameSamples::Impl {
    RowBlock rows;
};
FrameSamples::FrameSamples() : impl_(std::make_unique<Impl>()) {}
FrameSamples::~FrameSamples() = default;
void FrameSamples::begin_frame() noexcept {
    impl_->rows.kept = false;
}

struct ReprojectionSource::Impl {
    struct Window {
        KeptImage image;
        MotionGrid motion;
    };
    Impl(std::size_t width, std::size_t rows, std::size_t max_windows, std::size_t channels,
         std::size_t bodies)
        : channel_capacity(channels),
          images(width, rows, max_windows, channels, bodies),
          motions(width, rows, max_windows),
          windows(max_windows) {
        placed.reserve(max_windows);
        motion_jobs.reserve(rows / MotionGrid::cell_px + 3);
    }

    std::size_t channel_capacity;
    KeptMemory images;
    MotionGrid::Memory motions;
    std::vector<Window> windows;           ///< as many as are `placed`, and unused ones
    std::vector<KeptWindow> placed;        ///< see ReprojectionSource::windows()
    std::uint64_t kept_by = 0;             ///< number of the renderer of the light; 0: none yet
    std::vector<std::int32_t> motion_jobs; ///< rows of cells to be done
};
ReprojectionSource::~ReprojectionSource() = default;

struct Workspace::Impl {
    Scratch scratch;
    RowBlock rows;
};
Workspace::~Workspace() = default;
bool ReprojectionSource::begin_frame(std::span<const KeptWindow> windows) noexcept {
    impl_->kept_by = 0;
    impl_->placed.clear();
    impl_->images.clear();
    impl_->motions.clear();
    if (windows.size() > impl_->windows.size()) return false;
    for (std::size_t w = 0; w < windows.size(); ++w)
        if (Impl::Window& to = impl_->windows[w];
            !to.image.place(windows[w], impl_->channel_capacity, impl_->images) ||
            !to.motion.place(windows[w], impl_->motions))
            return false;
    impl_->placed.assign(windows.begin(), windows.end());
    return true;
}
std::span<const KeptWindow> ReprojectionSource::windows() const noexcept {
    return impl_->placed;
}
void ReprojectionSource::begin_reprojection() noexcept {
    for (std::size_t w = 0; w < impl_->placed.size(); ++w)
        impl_->windows[w].motion.restart();
}

namespace {

/// Variance of pixels that have samples, even if all are equal: 0 means none. Any positive number.
constexpr double min_variance = std::numeric_limits<double>::min();

/// Whether a pixel of a row of `width` pixels has light in some channel.
bool is_lit(std::span<const double> light, std::size_t x, std::size_t width) {
    for (; x < light.size(); x += width)
        if (light[x] > 0) return true;
    return false;
}

/// First samples of pixels of adaptive sampling where something moves: with fewer, too many of those that an
/// edge crosses during the exposure see only one side of it (measured by noise_estimate_test.cpp).
constexpr std::uint32_t min_moving_samples = 8;

/// Samples of a pixel of load_tiles().
constexpr std::uint32_t loading_samples = 4;

/// QualityLevel::goal: of the target error, or of the samples per pixel without one.
constexpr double larger_error = 2.5;
constexpr std::uint32_t fewer_samples = 4;
/// QualityLevel::instants.
constexpr std::uint32_t fewer_instants = 4;

constexpr auto min_float = static_cast<double>(std::numeric_limits<float>::min());

/// As std::fill(), which does not become memset for floats.
void clear(std::span<float> values) {
    if (!values.empty()) std::memset(values.data(), 0, values.size_bytes());
}

/// Brings the variance of 16 pixels from the tracer's unit to that of the image: no less than the rounding of
/// the image to float, nor than a float can hold; 0 where there are no samples.
OBSCURA_VECTOR_CLONES
void scale_packet(const double* __restrict light, const double* __restrict variance,
                  const double* __restrict per_pixel, double unit, float* __restrict out) {
    for (int i = 0; i < packet_size; ++i) {
        const double scale = unit * per_pixel[i];
        const double rounded = 0x1p-24 * light[i];
        const double least = rounded * rounded / 12;
        const double own = (variance[i] > least ? variance[i] : least) * scale * scale;
        const double kept = own > min_float ? own : min_float;
        out[i] = static_cast<float>(variance[i] > 0 ? kept : 0);
    }
}

/// Adds what is known of 16 pixels of a block.
OBSCURA_VECTOR_CLONES
void add_estimates(const BlockResult& result, float* __restrict samples, double* __restrict variance) {
    for (int i = 0; i < packet_size; ++i) {
        const auto n = static_cast<float>(static_cast<std::int32_t>(result.samples[i]));
        const double own = result.variance[i] > min_variance ? result.variance[i] : min_variance;
        samples[i] += result.covered[i] ? n : 0.0F;
        variance[i] = result.covered[i] ? own : variance[i];
    }
}

/// Counts a call while it lasts.
class ActiveCallGuard {
public:
    explicit ActiveCallGuard(std::atomic<int>& calls) : calls_(calls) {
        calls_.fetch_add(1, std::memory_order_relaxed);
    }
    ~ActiveCallGuard() { calls_.fetch_sub(1, std::memory_order_relaxed); }
    ActiveCallGuard(const ActiveCallGuard&) = delete;
    ActiveCallGuard& operator=(const ActiveCallGuard&) = delete;

private:
    std::atomic<int>& calls_;
};

/// Index of the sparse grid of a level in RowBlock::sparse, and its spacing. At QualityLevel::grid it serves
/// where no grid is shared.
std::size_t sparse_index(QualityLevel level) {
    return static_cast<std::size_t>(level) - static_cast<std::size_t>(QualityLevel::grid);
}
std::int32_t sparse_step(QualityLevel level) {
    return 1 << sparse_index(level);
}

/// Whether any body is small enough to be lost between the points of a grid, but larger than pixels.
bool has_small(std::span<const RowState> rows) {
    return std::any_of(rows.begin(), rows.end(), [](const RowState& row) {
        return std::any_of(row.bodies.begin(), row.bodies.end(), [](const BodyState& b) { return b.small; });
    });
}

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
    /// Memory of Renderer::overlay().
    struct OverlayMemory {
        StarsInView stars;
        Scratch scratch;
    };

    scene::Scene scene;
    RenderSettings settings;
    unsigned threads;
    std::unique_ptr<const Projection> lens;
    GaussianPsf gaussian_psf;
    std::optional<GaussianPsf> grid_psf; ///< of points of the sample grid that are means already
    std::unique_ptr<const Psf> psf;      ///< null: the Gaussian
    std::vector<BuiltBody> bodies;
    std::vector<const SurfaceTiles*> terrains;        ///< tiles of the bodies, each once
    mutable std::atomic<int> under_way{0};            ///< calls of render()
    std::vector<std::unique_ptr<TileLoader>> loaders; ///< of those, unless rendering waits for tiles
    std::vector<Vec3> landmarks_m;                    ///< see landmark_points()
    PointSplatter splatter;
    std::vector<StrayMap> stray;
    double field_rad;             ///< largest angle of a pixel's centre to the boresight
    std::vector<double> sun_w_m2; ///< per band, at 1 au
    Lighting lighting;
    Lighting lighting_few_bounces; ///< of QualityLevel::bounces
    bool plain = true;             ///< direct sunlight on grey surfaces: one channel is enough
    std::unique_ptr<const WingKernels> wing_kernels; ///< null: the PSF has no wings
    /// Raises the limit of TBB, one worker per core by default, to the number of threads.
    std::optional<tbb::global_control> more_threads;
    mutable tbb::task_arena arena;
    std::optional<WorkerObserver> observer; ///< with RenderSettings::enter_worker
    mutable tbb::enumerable_thread_specific<Scratch> scratch;
    /// Per thread that calls render().
    mutable tbb::enumerable_thread_specific<RowBlock> block_scratch;
    std::uint64_t number = next_number.fetch_add(1); ///< of this renderer, for what others keep
    static inline std::atomic<std::uint64_t> next_number{1};
    mutable std::mutex overlay_mutex;
    mutable std::unique_ptr<OverlayMemory> overlay_memory; ///< null: no overlay has been asked for
    mutable std::atomic<std::uint64_t> requests{0};
    mutable std::atomic<std::uint64_t> rays_done{0};
    mutable std::atomic<std::uint64_t> samples_done{0};
    mutable std::atomic<std::uint64_t> surface_hits{0}, tiles_missed{0}, pixels_filled{0};
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
          bodies(build_bodies(scene, r.shapes.get())),
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
                loaders.push_back(std::make_unique<TileLoader>(
                    *tiles, TileLoader::Settings{
                                .tiles_per_s = settings.tiles_per_s,
                                .enter = settings.enter_loader,
                                .share = settings.loader_share,
                                .busy = [this] { return under_way.load(std::memory_order_relaxed) > 0; }}));
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
        lighting_few_bounces = lighting;
        lighting_few_bounces.max_bounces = std::min(lighting.max_bounces, 1U);
        plain = settings.max_bounces == 0 && scene.lamps.empty() && !(psf && psf->chromatic()) &&
                std::all_of(bodies.begin(), bodies.end(), [](const BuiltBody& b) {
                    return b.colour.empty() && b.emission.empty() && (!b.textures || b.textures->grey());
                });
        set_grid_psf();
        if (psf && psf->wings_px() > 0)
            wing_kernels = std::make_unique<WingKernels>(*psf, plain ? 1 : scene.bands.size());
    }

    /// The light of terrains that keep the Sun's visibility is a mean about each ray: what that widens the
    /// PSF by is taken off the kernel of the sample grid.
    void set_grid_psf() {
        const bool means =
            plain && !terrains.empty() &&
            std::all_of(bodies.begin(), bodies.end(), [](const BuiltBody& body) {
                return body.material == nullptr || // the Sun
                       (body.shape->tiles() != nullptr && body.shape->tiles()->sun_visibility() != nullptr);
            });
        const double mean_px = sun_mean_sigma / std::sqrt(settings.samples_per_pixel);
        const double sigma2 = scene.camera.psf_sigma_px * scene.camera.psf_sigma_px - mean_px * mean_px;
        if (!means || !(sigma2 > 0)) return;
        const GaussianPsf narrower(std::sqrt(sigma2), scene.camera.pixel_aspect());
        if (SampleGridKernel::fits(narrower)) grid_psf = narrower;
    }
    void add_detail(DetailCounts& counts) const {
        surface_hits.fetch_add(counts.hits, std::memory_order_relaxed);
        tiles_missed.fetch_add(counts.missed, std::memory_order_relaxed);
        for (std::size_t k = 0; k < counts.coarser.size(); ++k)
            surface_coarser[k].fetch_add(counts.coarser[k], std::memory_order_relaxed);
        counts = {};
    }
    /// Frame key and, for single-threaded requests, the scratch buffer.
    struct RowsOf {
        std::uint64_t frame = 0;
        Scratch* alone = nullptr;
    };
    [[nodiscard]] RowsOf rows_of(const RenderRequest& request) const {
        return {frame_key(request), alone_scratch(request)};
    }
    [[nodiscard]] static Scratch* alone_scratch(const RenderRequest& request) {
        return request.alone != nullptr ? &request.alone->impl_->scratch : nullptr;
    }
    /// Scratch buffer of the calling thread.
    [[nodiscard]] Scratch& own_scratch(Scratch* alone) const {
        return alone != nullptr ? *alone : scratch.local();
    }
    /// Makes room in the memory of a thread for rows `width` pixels wide at any number of instants.
    void reserve(Scratch& s, std::int32_t width) const;
    /// Calls `do_row(r, scratch)` for rows [0, rows) on the workers; false when cancelled. Their time belongs
    /// to `part` where no lap assigns it.
    template<typename DoRow>
    bool for_rows(RenderPart part, std::int32_t rows, const RowsOf& of, const std::atomic<bool>* cancel,
                  const DoRow& do_row) const {
        return for_rows(part, rows, of, cancel, nullptr, do_row);
    }
    /// With a gate, which is asked for row `row_of(r)` of its request before row r: in the order of the rows.
    template<typename Wanted, typename DoRow>
    bool for_rows(RenderPart part, std::int32_t rows, const RowsOf& of, const std::atomic<bool>* cancel,
                  const Wanted& wanted, const DoRow& do_row) const;
    [[nodiscard]] TruthScene truth_scene(const FieldStars& stars, std::uint64_t frame_id,
                                         std::optional<Time> common, Scratch& s) const;
    /// What all requests of a frame have in common, for the tiles that it shows; 0: those that are there.
    [[nodiscard]] std::uint64_t frame_key(const RenderRequest& request) const {
        return frame_key(request.frame_id, request.common_mid);
    }
    [[nodiscard]] std::uint64_t frame_key(std::uint64_t frame_id, std::optional<Time> common_mid) const {
        if (loaders.empty()) return 0;
        const auto mid = static_cast<std::uint64_t>(common_mid ? common_mid->ns : 0);
        return (frame_id * 0x9e3779b97f4a7c15ull ^ mid * 0xc2b2ae3d27d4eb4full) | 1;
    }
    /// See Renderer::load_tiles(): one row.
    void load_row(const RenderRequest& request, std::int32_t r, Scratch& s) const;
    bool load_tiles(const RenderRequest& request, const std::function<bool(double)>& go_on) const;
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
    [[nodiscard]] std::uint32_t min_samples_of(const Exposure& when) const {
        return settings.target_error > 0 && when.instants > 1 ? min_moving_samples : 1;
    }
    /// Sets the lens for a row.
    void set_lens(Vec3 beta, Scratch& s) const {
        s.lens = lens.get();
        if (length(beta) > 0) s.lens = &s.moving_lens.emplace(*lens, beta);
    }
    /// Sets the lens and state `i` of a set-up, of Scratch::whole if none is given.
    RowState& begin_row(double time_s, Scratch& s, std::size_t i = 0, std::uint32_t min_samples = 1) const {
        return begin_row(time_s, s, s.whole, i, min_samples);
    }
    RowState& begin_row(double time_s, Scratch& s, RowSetUp& states, std::size_t i,
                        std::uint32_t min_samples) const {
        states.request = 0;
        if (states.rows.size() <= i) states.rows.resize(i + 1);
        RowState& row = states.rows[i];
        row.beta = camera_beta(scene, bodies, time_s);
        set_lens(row.beta, s);
        set_row_state(scene, bodies, *s.lens, sample_reach_px(),
                      std::max(settings.samples_per_pixel, min_samples), time_s, row);
        if (!terrains.empty())
            for (BodyState& body : row.bodies) {
                if (body.detail_view() == nullptr) continue;
                body.detail.wait = settings.wait_for_tiles || s.waits;
                body.detail.version = body.shape->tiles()->version_of(s.frame);
                body.detail.counts = &s.detail;
                if (body.shape->tiles()->sun_visibility() != nullptr)
                    body.detail.sun = rounded_sun(body.sun_m, scene.sun.radius_m);
            }
        if (lighting.max_bounces > 0 && lighting.has_sun()) find_planetshine(row);
        s.work.lap(RenderPart::setup);
        return row;
    }
    /// Sets up `states` at the instants of a row, unless they are those of the row of the same request
    /// before: the rows of a global shutter are exposed together.
    void begin_rows(std::uint64_t request, const Exposure& when, Scratch& s, RowSetUp& states) const {
        if (states.request == request && states.time == when.row && states.instants == when.instants) return;
        const std::uint32_t min_samples = min_samples_of(when);
        for (std::uint32_t i = 0; i < when.instants; ++i)
            begin_row(when.time_s(i), s, states, i, min_samples);
        join_instants({states.rows.data(), when.instants}, states.swept);
        states.request = request;
        states.time = when.row;
        states.instants = when.instants;
    }
    /// Calls `use(tracer)` with the tracer for the scene: direct sunlight only, or paths.
    template<typename Use>
    void with_tracer(const Instants& instants, Scratch& s, const Use& use,
                     QualityLevel level = QualityLevel::full) const;
    [[nodiscard]] static QualityLevel level_of(const RenderRequest& request, std::int32_t r) {
        return request.levels.empty() ? QualityLevel::full : request.levels[static_cast<std::size_t>(r)];
    }
    /// Instants at which the pixels of a row are sampled at a level.
    [[nodiscard]] Exposure exposure_at(QualityLevel level, const RowTime& row, Scratch& s) const {
        Exposure when = exposure(row, s);
        if (level >= QualityLevel::grid) return {row, 1};
        if (level >= QualityLevel::instants) when.instants = std::max(1U, when.instants / fewer_instants);
        return when;
    }
    /// Whether a row takes the sample grid of its frame: its only instant is that of the frame's rows.
    /// Depends on the row alone, whatever other rows the request has.
    [[nodiscard]] bool shares_samples(const RenderRequest& request, const RowTime& row, QualityLevel level,
                                      Scratch& s) const;
    bool fill_sample_grid(const RenderRequest& request, const std::atomic<bool>* cancel,
                          RowBlock& rows) const;
    bool fill_sparse_grid(const RenderRequest& request, QualityLevel level, const std::atomic<bool>* cancel,
                          RowBlock& rows) const;
    /// Traces Scratch-independent rows of points: job i belongs to row `row_of(i)` of the request, for its
    /// gate; `flag(i)` is 1 when it is done.
    template<typename RowOf, typename Fill, typename Flag>
    bool fill_rows(RenderPart part, const RenderRequest& request, const RowBlock& rows,
                   const std::atomic<bool>* cancel, const RowOf& row_of, const Fill& fill,
                   const Flag& flag) const;
    /// Finds the motion of the request's reprojected rows; false when cancelled.
    bool fill_motion(const RenderRequest& request, const std::atomic<bool>* cancel,
                     const RowBlock& rows) const;
    /// The same of its rows `first` to `last`, whatever their levels.
    bool fill_motion(const RenderRequest& request, std::int32_t first, std::int32_t last,
                     const std::atomic<bool>* cancel, const RowBlock& rows) const;
    /// Takes the row's pixels from an earlier frame.
    void take_earlier(const RenderRequest& request, std::int32_t y, QualityLevel level, std::size_t channels,
                      const RowState& now, Scratch& s) const;
    /// Sets Scratch::variance of such a row: bounds of what resampling, the light of another time, hidden
    /// places and, of repeated rows, motion make wrong; without the error of the earlier frame itself.
    void bound_variance(const KeptImage& image, std::int32_t y, QualityLevel level, std::size_t channels,
                        const RowState& now, Scratch& s) const;
    /// Keeps the light of a row's bodies.
    void keep_light(const RenderRequest& request, std::int32_t y, const Exposure& when, Scratch& s) const;
    /// Adds a block of a row's pixels. Returns false if no body is near.
    bool trace_block(const RenderRequest& request, std::int32_t y, std::int32_t block, BlockTracer& blocks,
                     const SampleGridKernel* kernel, const SampleGrid* grid, std::size_t channels,
                     Scratch& s) const;
    /// Rows of a shared grid above and below a pixel that it needs.
    [[nodiscard]] static std::int32_t grid_margin(const SampleGridKernel& kernel) {
        return std::max(kernel.reach, 1);
    }
    /// Whether the grids have what row `r` needs.
    [[nodiscard]] bool grids_ready(const RenderRequest& request, const RowBlock& rows, std::int32_t r,
                                   Scratch& s) const;
    /// Interpolates the row's pixels from a sparse grid. Returns false if all are dark.
    bool take_sparse(const RenderRequest& request, std::int32_t y, const SparseGrid& grid,
                     std::size_t channels, Scratch& s) const;
    /// Traces the blocks with small bodies as at QualityLevel::full.
    void trace_small_bodies(const RenderRequest& request, std::int32_t y, const Instants& instants,
                            Tracer& tracer, Scratch& s) const;
    /// Traces the small bodies that the request's rows share; false when cancelled.
    bool fill_points(const RenderRequest& request, const std::atomic<bool>* cancel, RowBlock& rows) const;
    /// Adds the small bodies at instant `instant` of the row's exposure.
    void splat_bodies(const RenderRequest& request, const RowBlock& rows, const SplatTarget& target,
                      std::uint32_t instant, Tracer& tracer, Scratch& s) const;
    /// Makes the wings of the request's rows ready; false when cancelled.
    bool fill_wings(const RenderRequest& request, const std::atomic<bool>* cancel, RowBlock& rows) const;
    bool fill_wing_map(const WingMaps::Needed& needed, Scratch* alone, const std::atomic<bool>* cancel) const;
    [[nodiscard]] static std::int32_t plane_rows(const RenderRequest& request) {
        return request.plane_rows > 0 ? request.plane_rows : request.rows;
    }
    /// Row of the sensor that row `r` of a request is, and its row in what is kept of its window.
    [[nodiscard]] static std::int32_t sensor_y(const RenderRequest& request, std::int32_t r) {
        return request.window.y + request.first_row + (request.line ? 0 : r);
    }
    [[nodiscard]] static std::int32_t kept_y(const RenderRequest& request, std::int32_t r) {
        return request.line ? *request.line + r : sensor_y(request, r);
    }
    /// Renders each line of a push-broom sensor by a request of its own.
    bool render_line_by_line(const Renderer& self, const RenderRequest& request, std::span<float> irradiance,
                             const std::atomic<bool>* cancel) const;
    RenderedRow render_row(const RenderRequest& request, const RowBlock& rows, std::int32_t r,
                           std::span<float> irradiance, Scratch& s) const;
    /// Adds the light of the row's pixel samples. Returns false if no body is near.
    bool trace_pixels(const RenderRequest& request, std::int32_t y, const RowBlock& rows,
                      const Instants& instants, std::span<const SweptBody> swept, QualityLevel level,
                      Tracer& tracer, Scratch& s) const;
    /// Brings the variance of a row from Scratch::variance to the image's unit.
    void scale_variance(Scratch& s, std::span<float> variance) const;
    [[nodiscard]] Sampling sampling(const RenderRequest& request,
                                    QualityLevel level = QualityLevel::full) const {
        Sampling how{settings.seed, request.frame_id, settings.max_samples_per_pixel, settings.target_error};
        if (level == QualityLevel::full) return how;
        how.target_error *= larger_error;
        if (settings.target_error == 0)
            how.sample_limit = std::max(1U, settings.samples_per_pixel / fewer_samples);
        if (level < QualityLevel::grid) return how;
        how.grid_only = true;
        return how;
    }
    /// Largest displacement of a camera sample by the PSF, along an axis.
    [[nodiscard]] double sample_reach_px() const { return psf ? psf->reach_px() : gaussian_psf.reach_px(); }
    /// Standard deviation of a pixel's response along an axis, PSF and pixel.
    [[nodiscard]] double response_px() const {
        return std::sqrt(gaussian_psf.x.sigma_px() * gaussian_psf.x.sigma_px() + 1.0 / 12);
    }
    /// Largest angle across a square of a pixel's area, for the footprints of rays.
    [[nodiscard]] double pixel_width_rad() const {
        return lens->pixel_angle_rad() * std::sqrt(scene.camera.pixel_flattening());
    }
};

template<typename Wanted, typename DoRow>
bool Renderer::Impl::for_rows(RenderPart part, std::int32_t row_count, const RowsOf& of,
                              const std::atomic<bool>* cancel, const Wanted& wanted,
                              const DoRow& do_row) const {
    constexpr bool gated = !std::is_null_pointer_v<Wanted>;
    std::atomic<bool> complete{true};
    std::atomic<std::int32_t> next{0}; // gated: rows are taken in their order
    const auto do_rows = [&](std::int32_t begin, std::int32_t end, Scratch& local) {
        const FlushDenormals flush;
        bool begun = false;
        local.work.start(part);
        for (std::int32_t r = gated ? next.fetch_add(1) : begin; r < end;
             r = gated ? next.fetch_add(1) : r + 1) {
            if constexpr (gated)
                if (!wanted(r)) {
                    complete.store(false, std::memory_order_relaxed);
                    continue;
                }
            if (cancel != nullptr && cancel->load(std::memory_order_relaxed)) {
                complete.store(false, std::memory_order_relaxed);
                break;
            }
            if (local.frame != of.frame) local.whole.request = local.fewer.request = local.middle.request = 0;
            local.frame = of.frame;
            if (settings.before_row && of.alone == nullptr) settings.before_row(!begun);
            begun = true;
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
        // The last row may have been cut short.
        if (cancel != nullptr && cancel->load(std::memory_order_relaxed))
            complete.store(false, std::memory_order_relaxed);
        local.pins.clear();
        local.work.stop(work_done);
    };
    if (of.alone != nullptr) {
        do_rows(0, row_count, *of.alone);
        return complete.load();
    }
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
            if constexpr (gated)
                do_rows(0, row_count, own);
            else
                do_rows(first_row_of(i), first_row_of(i + 1), own);
        });
    workers.clear();
#else
    arena.execute([&] {
        if constexpr (gated)
            tbb::parallel_for(
                tbb::blocked_range<std::int32_t>(0, static_cast<std::int32_t>(threads), 1),
                [&](const tbb::blocked_range<std::int32_t>&) { do_rows(0, row_count, scratch.local()); },
                tbb::simple_partitioner());
        else
            tbb::parallel_for(tbb::blocked_range<std::int32_t>(0, row_count),
                              [&](const tbb::blocked_range<std::int32_t>& rows) {
                                  do_rows(rows.begin(), rows.end(), scratch.local());
                              });
    });
#endif
    return complete.load();
}

template<typename Use>
void Renderer::Impl::with_tracer(const Instants& instants, Scratch& s, const Use& use,
                                 QualityLevel level) const {
    const double ray_width_rad = pixel_width_rad() / std::sqrt(settings.samples_per_pixel);
    if (plain) {
        Tracer tracer(instants, scene.sun, s.counts);
        tracer.set_ray_width(ray_width_rad);
        use(tracer);
    } else {
        PathTracer tracer(instants, level == QualityLevel::bounces ? lighting_few_bounces : lighting,
                          scene.sun, s.counts);
        tracer.set_ray_width(ray_width_rad);
        use(tracer);
    }
}

bool Renderer::Impl::shares_samples(const RenderRequest& request, const RowTime& row, QualityLevel level,
                                    Scratch& s) const {
    if (level >= QualityLevel::quarter) return false;
    // Share samples only at <= 2 spp: a higher count is an explicit request.
    return settings.target_error > 0 && settings.samples_per_pixel <= 2 && !psf &&
           request.common_mid == row.mid() && SampleGridKernel::fits(gaussian_psf) &&
           exposure_at(level, row, s).instants == 1;
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
            loaders[k]->predict(
                {from_inertial * (camera.position_m - pose.position_m),
                 from_inertial * (inertial_from_camera * Vec3{0, 0, 1}), 1.1 * field_rad,
                 terrains[k]->cell_px() * lens->pixel_angle_rad(),
                 rounded_sun(from_inertial * (scene.sun.position_at(time_s) - pose.position_m),
                             scene.sun.radius_m)});
            break;
        }
}

bool Renderer::Impl::fill_sample_grid(const RenderRequest& request, const std::atomic<bool>* cancel,
                                      RowBlock& rows) const {
    Scratch& own = own_scratch(alone_scratch(request));
    const auto shares = [&](std::int32_t r) {
        return shares_samples(request, request.row_times[static_cast<std::size_t>(r)], level_of(request, r),
                              own);
    };
    std::int32_t first = 0;
    while (first < request.rows && !shares(first))
        ++first;
    if (first == request.rows) return true;
    SampleGrid& grid = rows.grid;
    if (!rows.kernel) {
        rows.kernel.emplace(grid_psf ? *grid_psf : gaussian_psf, settings.seed, request.frame_id);
        const bool whole = request.kept != nullptr;
        const Region window{request.window.x, whole ? request.frame_y : request.window.y,
                            request.window.width, request.window.height};
        grid.reset(window, whole ? 0 : request.first_row,
                   whole ? static_cast<std::int32_t>(request.frame_times.size()) : request.rows,
                   plain ? 1 : scene.bands.size(), rows.kernel->reach);
        rows.grid_filled.assign(static_cast<std::size_t>(grid.height()), 0);
    }
    // Rows of points about those pixels, in their order.
    const std::int32_t margin = grid_margin(*rows.kernel);
    const std::int32_t top = request.window.y + request.first_row - grid.first_y();
    rows.grid_jobs.clear();
    for (std::int32_t r = first; r < request.rows; ++r) {
        if (!shares(r)) continue;
        for (std::int32_t at = top + r - margin; at <= top + r + margin; ++at)
            if (std::uint8_t& filled = rows.grid_filled[static_cast<std::size_t>(at)]; filled == 0) {
                filled = 2; // listed
                rows.grid_jobs.push_back(at);
            }
    }
    const double time_s = to_seconds(request.common_mid->ns);
    const auto fill = [&](std::int32_t job, Scratch& s) {
        const std::int32_t r = rows.grid_jobs[static_cast<std::size_t>(job)];
        const RowState& row = begin_row(time_s, s);
        if (resolves_any(row, field_rad))
            with_tracer(row, s, [&](Tracer& tracer) {
                const Sampling how = sampling(request);
                BlockTracer blocks(*s.lens, gaussian_psf, psf.get(), how, row, {}, tracer, s.candidates);
                const std::int32_t first_block = BlockTracer::block_of(grid.first_x());
                for (std::int32_t block = 0; block < grid.width() / packet_size; ++block)
                    blocks.trace_grid(first_block + block, grid.first_y() + r, *rows.kernel, grid);
            });
        rows.grid_filled[static_cast<std::size_t>(r)] = 1;
    };
    return fill_rows(
        RenderPart::grid, request, rows, cancel,
        [&](std::int32_t job) {
            return std::clamp(rows.grid_jobs[static_cast<std::size_t>(job)] - margin - top, first,
                              request.rows - 1);
        },
        fill,
        [&](std::int32_t job) -> std::uint8_t& {
            return rows.grid_filled[static_cast<std::size_t>(rows.grid_jobs[static_cast<std::size_t>(job)])];
        });
}

bool Renderer::Impl::fill_sparse_grid(const RenderRequest& request, QualityLevel level,
                                      const std::atomic<bool>* cancel, RowBlock& rows) const {
    const auto index = sparse_index(level);
    Scratch& own = own_scratch(alone_scratch(request));
    const auto asks = [&](std::int32_t r) {
        return level_of(request, r) == level &&
               !shares_samples(request, request.row_times[static_cast<std::size_t>(r)], level, own);
    };
    std::int32_t first = 0;
    while (first < request.rows && !asks(first))
        ++first;
    if (first == request.rows) return true;
    SparseGrid& grid = rows.sparse[index];
    const std::int32_t top = request.window.y + request.first_row;
    const bool whole = !request.frame_times.empty();
    const std::span<const RowTime> times = whole ? request.frame_times : request.row_times;
    const std::int32_t times_y = whole ? request.frame_y : top;
    if (!rows.sparse_begun[index]) {
        const bool kept = request.kept != nullptr;
        grid.reset(sparse_step(level), request.window.x, request.window.width, kept ? request.frame_y : top,
                   kept ? static_cast<std::int32_t>(times.size()) : request.rows,
                   plain ? 1 : scene.bands.size(), response_px(), settings.seed, request.frame_id);
        rows.sparse_begun[index] = true;
    }
    rows.grid_jobs.clear();
    for (std::int32_t r = first; r < request.rows; ++r) {
        if (!asks(r)) continue;
        const std::int32_t about = grid.row_about(top + r);
        for (std::int32_t at = about - 1; at <= about + 2; ++at)
            if (std::uint8_t& filled = grid.filled(at); filled == 0) {
                filled = 2;
                rows.grid_jobs.push_back(at);
            }
    }
    const auto fill = [&](std::int32_t job, Scratch& s) {
        const std::int32_t r = rows.grid_jobs[static_cast<std::size_t>(job)];
        const double y = grid.y_of(r);
        const auto nearest = static_cast<std::int32_t>(std::floor(y + 0.5)) - times_y;
        const RowTime& time = times[static_cast<std::size_t>(
            std::clamp(nearest, 0, static_cast<std::int32_t>(times.size()) - 1))];
        const RowState& row = begin_row(to_seconds(time.mid().ns), s);
        if (resolves_any(row, field_rad))
            with_tracer(row, s, [&](Tracer& tracer) {
                const Sampling how = sampling(request);
                BlockTracer blocks(*s.lens, gaussian_psf, psf.get(), how, row, {}, tracer, s.candidates);
                for (std::int32_t c = 0; c < grid.columns(); c += packet_size)
                    blocks.trace_points(grid.x_of(c), y, grid.step(), grid.row(r) + c, grid.plane());
            });
        grid.filled(r) = 1;
    };
    const bool filled = fill_rows(
        RenderPart::grid, request, rows, cancel,
        [&](std::int32_t job) {
            const double y = grid.y_of(rows.grid_jobs[static_cast<std::size_t>(job)]);
            return std::clamp(static_cast<std::int32_t>(y) - 2 * grid.step() - top, first, request.rows - 1);
        },
        fill,
        [&](std::int32_t job) -> std::uint8_t& {
            return grid.filled(rows.grid_jobs[static_cast<std::size_t>(job)]);
        });
    if (!filled) return false;
    rows.grid_jobs.clear();
    for (std::int32_t r = first; r < request.rows; ++r) {
        if (!asks(r)) continue;
        const std::int32_t about = grid.row_about(top + r);
        for (const std::int32_t at : {about, about + 1})
            if (!grid.estimated(at) && grid.can_estimate(at) &&
                (rows.grid_jobs.empty() || rows.grid_jobs.back() < at))
                rows.grid_jobs.push_back(at);
    }
    return for_rows(RenderPart::grid, static_cast<std::int32_t>(rows.grid_jobs.size()), rows_of(request),
                    cancel, [&](std::int32_t job, Scratch&) {
                        grid.estimate(rows.grid_jobs[static_cast<std::size_t>(job)],
                                      plain ? 1 : scene.bands.size());
                    });
}

template<typename RowOf, typename Fill, typename Flag>
bool Renderer::Impl::fill_rows(RenderPart part, const RenderRequest& request, const RowBlock& rows,
                               const std::atomic<bool>* cancel, const RowOf& row_of, const Fill& fill,
                               const Flag& flag) const {
    const auto jobs = static_cast<std::int32_t>(rows.grid_jobs.size());
    if (request.gate == nullptr) return for_rows(part, jobs, rows_of(request), cancel, fill);
    for_rows(
        part, jobs, rows_of(request), cancel,
        [&](std::int32_t job) { return request.gate->wants(row_of(job)); }, fill);
    for (std::int32_t job = 0; job < jobs; ++job)
        if (std::uint8_t& filled = flag(job); filled != 1) filled = 0;
    // Rows of pixels that lack points are left out one by one.
    return cancel == nullptr || !cancel->load(std::memory_order_relaxed);
}

bool Renderer::Impl::grids_ready(const RenderRequest& request, const RowBlock& rows, std::int32_t r,
                                 Scratch& s) const {
    const QualityLevel level = level_of(request, r);
    if (level >= QualityLevel::reprojected) return true;
    const std::int32_t y = request.window.y + request.first_row + r;
    const bool shared =
        rows.kernel && shares_samples(request, request.row_times[static_cast<std::size_t>(r)], level, s);
    if (!shared) return level < QualityLevel::grid || rows.sparse[sparse_index(level)].ready(y);
    const std::int32_t margin = grid_margin(*rows.kernel);
    const auto at = rows.grid_filled.begin() + (y - rows.grid.first_y());
    return std::all_of(at - margin, at + margin + 1, [](std::uint8_t filled) { return filled == 1; });
}

bool Renderer::Impl::fill_motion(const RenderRequest& request, const std::atomic<bool>* cancel,
                                 const RowBlock& rows) const {
    const auto asks = [&](std::int32_t r) { return level_of(request, r) == QualityLevel::reprojected; };
    std::int32_t first = 0;
    while (first < request.rows && !asks(first))
        ++first;
    if (first == request.rows) return true;
    std::int32_t last = request.rows - 1;
    while (!asks(last))
        --last;
    return fill_motion(request, first, last, cancel, rows);
}

bool Renderer::Impl::fill_motion(const RenderRequest& request, std::int32_t first, std::int32_t last,
                                 const std::atomic<bool>* cancel, const RowBlock& rows) const {
    ReprojectionSource::Impl& from = *request.from->impl_;
    const KeptImage& image = from.windows[request.kept_window].image;
    MotionGrid& motion = from.windows[request.kept_window].motion;
    const std::int32_t top = kept_y(request, 0);
    const bool whole = !request.frame_times.empty();
    const std::span<const RowTime> times = whole ? request.frame_times : request.row_times;
    const std::int32_t times_y = !whole ? top : request.line ? 0 : request.frame_y;
    const auto middle_of = [&](std::int32_t y) {
        const auto end = static_cast<std::int32_t>(times.size()) - 1;
        const std::int32_t at = std::clamp(y - times_y, 0, end);
        const Time mid = times[static_cast<std::size_t>(at)].mid();
        // Lines follow each other at their rate, beyond the last one, too.
        const std::int64_t beyond = request.line && end > 0 ? y - times_y - at : 0;
        return mid + beyond * (times.back().mid() - times.front().mid()) / std::max(end, 1);
    };
    const auto trace = [&](std::int32_t y, Scratch& s, const auto& use) {
        const Time mid = middle_of(y);
        begin_rows(rows.request, Exposure{RowTime{mid, mid}, 1}, s, s.middle);
        const RowState& row = s.middle.rows[0];
        set_lens(row.beta, s);
        with_tracer(row, s, [&](Tracer& tracer) {
            use(MotionGrid::View{*s.lens, *lens, row, mid, tracer, s.candidates, image});
        });
    };
    // Each step on the rows about those of the step after it.
    const std::int32_t begin = motion.cell_row_of(top + first);
    const std::int32_t end = motion.cell_row_of(top + last) + 1;
    const auto step = [&](MotionGrid::Step which, std::int32_t margin, const auto& fill) {
        from.motion_jobs.clear();
        for (std::int32_t r = std::max(0, begin - margin); r <= std::min(motion.cell_rows(), end + margin);
             ++r)
            if (motion.done(r) < which) from.motion_jobs.push_back(r);
        return for_rows(RenderPart::grid, static_cast<std::int32_t>(from.motion_jobs.size()),
                        rows_of(request), cancel, [&](std::int32_t job, Scratch& s) {
                            const std::int32_t r = from.motion_jobs[static_cast<std::size_t>(job)];
                            fill(r, s);
                            motion.done(r) = which;
                        });
    };
    return step(MotionGrid::Step::corners, 3,
                [&](std::int32_t r, Scratch& s) {
                    trace(motion.y_of(r), s, [&](const MotionGrid::View& v) { motion.trace_corners(r, v); });
                }) &&
           step(MotionGrid::Step::inner, 1,
                [&](std::int32_t r, Scratch& s) {
                    for (std::int32_t fine = 0; fine < MotionGrid::fine_cells; ++fine)
                        if (motion.has_inner(r, fine))
                            trace(motion.y_of(r, fine), s,
                                  [&](const MotionGrid::View& v) { motion.trace_inner(r, fine, v); });
                }) &&
           step(MotionGrid::Step::joined, 0, [&](std::int32_t r, Scratch&) { motion.join(r); });
}

void Renderer::Impl::take_earlier(const RenderRequest& request, std::int32_t y, QualityLevel level,
                                  std::size_t channels, const RowState& now, Scratch& s) const {
    s.add_sampled(0, request.window.width, request.window.width);
    const ReprojectionSource::Impl::Window& from = request.from->impl_->windows[request.kept_window];
    const KeptImage& image = from.image;
    const Region& area = image.area();
    const auto width = static_cast<std::size_t>(area.width);
    const std::int32_t row = std::clamp(y - area.y, 0, area.height - 1);
    if (level == QualityLevel::repeated) {
        for (std::size_t c = 0; c < channels; ++c)
            std::copy_n(image.plane(c) + static_cast<std::size_t>(row) * width, width,
                        s.light.begin() + static_cast<std::ptrdiff_t>(c * width));
    } else {
        MotionGrid::Row& motion = s.motion_of_row;
        from.motion.take(y, image.lit(), motion);
        pixels_filled.fetch_add(static_cast<std::uint64_t>(motion.filled_count), std::memory_order_relaxed);
        for (std::size_t cell = 0; cell < motion.dark.size(); ++cell) {
            if (motion.dark[cell] != 0) continue;
            const std::size_t begin = std::max(cell * MotionGrid::cell_px, motion.first);
            const std::size_t end = std::min((cell + 1) * MotionGrid::cell_px, motion.first + width);
            const auto part = [&](const std::vector<float>& v) {
                return std::span(v).subspan(begin, end - begin);
            };
            const std::size_t x = begin - motion.first;
            for (std::size_t c = 0; c < channels; ++c)
                resample_row({image.plane(c), area.width, area.height}, static_cast<std::int32_t>(x), row,
                             part(motion.dx), part(motion.dy), part(motion.gain),
                             s.light.data() + c * width + x);
        }
    }
    if (!request.samples.empty()) {
        const std::size_t at = static_cast<std::size_t>(s.row) * width;
        constexpr float share = 1.0F / (MotionGrid::cell_px * MotionGrid::cell_px);
        for (std::size_t x = 0; x < width; ++x)
            if (is_lit(s.light, x, width)) request.samples[at + x] = share;
    }
    if (!request.variance.empty()) bound_variance(image, y, level, channels, now, s);
}

void Renderer::Impl::bound_variance(const KeptImage& image, std::int32_t y, QualityLevel level,
                                    std::size_t channels, const RowState& now, Scratch& s) const {
    // Share of the second difference that is lost along an axis, mean over the places between pixels
    // (measured by reprojection_test.cpp).
    constexpr double resampled = 0.06;
    // Brightness over the cosine of incidence at which its change by the angle is typical.
    constexpr double slope = 2;
    const KeptView::Change change = image.views_about(y).first->change_to(now, *lens, field_rad);
    const bool moved = level == QualityLevel::reprojected;
    const auto width = static_cast<std::ptrdiff_t>(s.variance.size());
    const auto light = [&](std::ptrdiff_t x) {
        double sum = 0;
        for (std::size_t c = 0; c < channels; ++c)
            sum += s.light[c * s.variance.size() +
                           static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(x, 0, width - 1))];
        return sum / static_cast<double>(channels);
    };
    double before = light(0);
    double here = before;
    for (std::ptrdiff_t x = 0; x < width; ++x) {
        const double next = light(x + 1);
        double error = slope * change.sun_rad * here;
        if (moved)
            error = std::hypot(error, std::sqrt(2.0) * resampled * (before - 2 * here + next));
        else
            error +=
                std::min(here, change.motion_px * std::max(std::abs(next - here), std::abs(here - before)));
        const auto pixel = static_cast<std::size_t>(x);
        if (moved && s.motion_of_row.filled[s.motion_of_row.first + pixel] != 0) error = here;
        s.variance[pixel] = here > 0 ? std::max(error * error, min_variance) : 0;
        before = here;
        here = next;
    }
}

void Renderer::Impl::keep_light(const RenderRequest& request, std::int32_t y, const Exposure& when,
                                Scratch& s) const {
    KeptImage& image = request.keep->impl_->windows[request.kept_window].image;
    image.keep_row(y, s.light);
    // Makes room for the rows that are made of it, on each thread once.
    s.motion_of_row.resize(static_cast<std::size_t>(request.window.width));
    if (s.middle.rows.empty()) begin_row(to_seconds(when.row.mid().ns), s, s.middle, 0, 1);
    if (!image.wants_view(y)) return;
    const Time mid = when.row.mid();
    image.set_view(y, mid,
                   when.instants == 1 ? s.whole.rows[0] : begin_row(to_seconds(mid.ns), s, s.middle, 0, 1));
}

bool Renderer::Impl::take_sparse(const RenderRequest& request, std::int32_t y, const SparseGrid& grid,
                                 std::size_t channels, Scratch& s) const {
    s.add_sampled(0, request.window.width, request.window.width);
    const auto width = static_cast<std::size_t>(request.window.width);
    for (std::size_t c = 0; c < channels; ++c)
        grid.interpolate(c, request.window.x, y, std::span(s.light).subspan(c * width, width));
    if (!request.variance.empty()) {
        grid.variance(request.window.x, y, std::span(s.variance).first(width));
        for (std::size_t x = 0; x < width; ++x)
            s.variance[x] = is_lit(s.light, x, width) ? std::max(s.variance[x], min_variance) : 0;
    }
    if (!request.samples.empty()) {
        const auto row = static_cast<std::size_t>(s.row);
        const float share = 1 / static_cast<float>(grid.step() * grid.step());
        for (std::size_t x = 0; x < width; ++x)
            if (is_lit(s.light, x, width)) request.samples[row * width + x] = share;
    }
    return std::any_of(s.light.begin(), s.light.end(), [](double light) { return light > 0; });
}

void Renderer::Impl::trace_small_bodies(const RenderRequest& request, std::int32_t y,
                                        const Instants& instants, Tracer& tracer, Scratch& s) const {
    const auto width = static_cast<std::size_t>(request.window.width);
    const Sampling how = sampling(request);
    BlockTracer blocks(instants.one() ? *s.lens : *lens, gaussian_psf, psf.get(), how, instants,
                       s.whole.swept, tracer, s.candidates);
    const std::int32_t first = BlockTracer::block_of(request.window.x);
    const std::int32_t last = BlockTracer::block_of(request.window.x + request.window.width - 1);
    for (std::int32_t block = first; block <= last; ++block) {
        if (const NearBodies near = blocks.near(block, y); near.samples == 0 || !near.small) continue;
        for (int i = 0; i < packet_size; ++i) {
            const std::int32_t column = block * packet_size + i - request.window.x;
            if (column < 0 || column >= request.window.width) continue;
            for (std::size_t c = 0; c < tracer.channels(); ++c)
                s.light[c * width + static_cast<std::size_t>(column)] = 0;
            if (!request.variance.empty()) s.variance[static_cast<std::size_t>(column)] = 0;
            if (!request.samples.empty())
                request.samples[static_cast<std::size_t>(s.row) * width + static_cast<std::size_t>(column)] =
                    0;
        }
        trace_block(request, y, block, blocks, nullptr, nullptr, tracer.channels(), s);
    }
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
    Scratch& own = own_scratch(alone_scratch(request));
    const Exposure when = exposure(times.front(), own);
    const std::uint32_t min_samples = min_samples_of(when);
    const auto view = [&](const RowState& row, Scratch& s) {
        return PointView{request.window, request.window.y + request.first_row,
                         request.rows,   request.frame_id,
                         false,          row,
                         *s.lens,        s.candidates};
    };
    for (std::uint32_t i = 0; i < when.instants; ++i) {
        const RowState& row = begin_row(when.time_s(i), own, 0, min_samples);
        with_tracer(row, own, [&](const Tracer& tracer) {
            splatter.plan_points(view(row, own), i, when.instants, tracer, shared.jobs);
        });
    }
    if (shared.done.size() < shared.jobs.size()) shared.done.resize(shared.jobs.size());
    return for_rows(RenderPart::points, static_cast<std::int32_t>(shared.jobs.size()), rows_of(request),
                    cancel, [&](std::int32_t j, Scratch& s) {
                        const PointJob& job = shared.jobs[static_cast<std::size_t>(j)];
                        const RowState& row = begin_row(when.time_s(job.instant), s, 0, min_samples);
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
    const bool alone = request.common_mid != request.row_times[static_cast<std::size_t>(s.row)].mid();
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
    return std::all_of(needed.begin(), needed.end(), [&](const WingMaps::Needed& n) {
        return fill_wing_map(n, alone_scratch(request), cancel);
    });
}

bool Renderer::Impl::fill_wing_map(const WingMaps::Needed& needed, Scratch* alone,
                                   const std::atomic<bool>* cancel) const {
    WingMap& map = *needed.map;
    const double time_s = to_seconds(map.time().ns);
    if (!map.has_bodies()) {
        Scratch& s = own_scratch(alone);
        const RowState& row = begin_row(time_s, s);
        map.set_bodies(*s.lens, row);
    }
    // Calls `use(job, view)` for every job, with the scene at the map's time.
    const auto trace = [&](std::int32_t jobs, const auto& use) {
        return for_rows(RenderPart::wings, jobs, {0, alone}, cancel, [&](std::int32_t i, Scratch& s) {
            const RowState& row = begin_row(time_s, s);
            with_tracer(row, s, [&](Tracer& tracer) {
                use(i, WingMap::View{*s.lens, row, tracer, s.candidates, settings.seed});
            });
        });
    };
    const auto each = [&](std::span<const WingMap::Job> jobs, const auto& use) {
        return for_rows(RenderPart::wings, static_cast<std::int32_t>(jobs.size()), {0, alone}, cancel,
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

bool Renderer::Impl::trace_block(const RenderRequest& request, std::int32_t y, std::int32_t block,
                                 BlockTracer& blocks, const SampleGridKernel* kernel, const SampleGrid* grid,
                                 std::size_t channels, Scratch& s) const {
    const auto width = static_cast<std::size_t>(request.window.width);
    BlockResult result;
    const bool estimates = !request.variance.empty();
    if (!blocks.trace(block, y, result, estimates, kernel, grid)) return false;
    s.add_sampled(block * packet_size - request.window.x, packet_size, request.window.width);
    const std::int32_t first = block * packet_size - request.window.x;
    const int begin = std::max(0, -first), end = std::min(packet_size, request.window.width - first);
    const auto row_from = [&](auto& row, std::size_t at) {
        return row.data() + at + static_cast<std::size_t>(first + begin);
    };
    for (std::size_t c = 0; c < channels; ++c) {
        double* const light = row_from(s.light, c * width);
        for (int i = begin; i < end; ++i)
            if (result.covered[i]) light[i - begin] += result.mean[c][i];
    }
    if (estimates && !request.samples.empty() && end - begin == packet_size) {
        add_estimates(result, row_from(request.samples, static_cast<std::size_t>(s.row) * width),
                      row_from(s.variance, 0));
        return true;
    }
    if (!request.samples.empty()) {
        float* const samples = row_from(request.samples, static_cast<std::size_t>(s.row) * width);
        for (int i = begin; i < end; ++i)
            if (result.covered[i]) samples[i - begin] += static_cast<float>(result.samples[i]);
    }
    if (estimates) {
        double* const variance = row_from(s.variance, 0);
        for (int i = begin; i < end; ++i)
            if (result.covered[i]) variance[i - begin] = std::max(result.variance[i], min_variance);
    }
    return true;
}

bool Renderer::Impl::trace_pixels(const RenderRequest& request, std::int32_t y, const RowBlock& rows,
                                  const Instants& instants, std::span<const SweptBody> swept,
                                  QualityLevel level, Tracer& tracer, Scratch& s) const {
    if (level >= QualityLevel::reprojected) {
        const std::span<const RowState> states = instants.states();
        take_earlier(request, kept_y(request, s.row), level, tracer.channels(), states[states.size() / 2], s);
        return true;
    }
    if (std::none_of(instants.states().begin(), instants.states().end(),
                     [&](const RowState& row) { return resolves_any(row, field_rad); }))
        return false;
    const bool shared =
        rows.kernel && shares_samples(request, request.row_times[static_cast<std::size_t>(s.row)], level, s);
    const bool sparse = level >= QualityLevel::grid && !shared;
    if (sparse && take_sparse(request, y, rows.sparse[sparse_index(level)], tracer.channels(), s))
        return true;
    Sampling how = sampling(request, level);
    how.cancel = rows.cancel;
    BlockTracer blocks(instants.one() ? *s.lens : *lens, gaussian_psf, psf.get(), how, instants, swept,
                       tracer, s.candidates);
    const std::int32_t last = BlockTracer::block_of(request.window.x + request.window.width - 1);
    const std::int32_t first = BlockTracer::block_of(request.window.x);
    bool near = false;
    for (std::int32_t block = first; block <= last; ++block) {
        // A body may be hidden between the points of a sparse grid.
        if (sparse && blocks.near(block, y).samples > 0) return true;
        if (sparse) continue;
        near = trace_block(request, y, block, blocks, shared ? &*rows.kernel : nullptr,
                           shared ? &rows.grid : nullptr, tracer.channels(), s) ||
               near;
    }
    return near;
}

void Renderer::Impl::scale_variance(Scratch& s, std::span<float> variance) const {
    const double unit =
        plain ? std::accumulate(sun_w_m2.begin(), sun_w_m2.end(), 0.0) / static_cast<double>(sun_w_m2.size())
              : 1;
    const std::size_t width = variance.size();
    const std::size_t channels = s.light.size() / width;
    const double share = 1 / static_cast<double>(channels);
    constexpr std::size_t packet = packet_size;
    const std::size_t first = s.first_sampled / packet * packet;
    const std::size_t end = std::max(first, std::min(width, (s.end_sampled + packet - 1) / packet * packet));
    clear(variance.first(first));
    clear(variance.subspan(end));
    for (std::size_t x = first; x < end; x += packet) {
        const std::size_t count = std::min(packet, width - x);
        if (count == packet && channels == 1) {
            scale_packet(&s.light[x], &s.variance[x], &s.per_pixel[x], unit, &variance[x]);
            continue;
        }
        Doubles light{}, own{}, per_pixel{};
        for (std::size_t c = 0; c < channels; ++c)
            for (std::size_t i = 0; i < count; ++i)
                light.v[i] += share * s.light[c * width + x + i];
        std::copy_n(s.variance.data() + x, count, own.v);
        std::copy_n(s.per_pixel.data() + x, count, per_pixel.v);
        float out[packet];
        scale_packet(light.v, own.v, per_pixel.v, unit, out);
        std::copy_n(out, count, variance.data() + x);
    }
    std::fill(s.variance.begin() + static_cast<std::ptrdiff_t>(first),
              s.variance.begin() + static_cast<std::ptrdiff_t>(end), 0.0);
}

RenderedRow Renderer::Impl::render_row(const RenderRequest& request, const RowBlock& rows, std::int32_t r,
                                       std::span<float> irradiance, Scratch& s) const {
    const auto width = static_cast<std::size_t>(request.window.width);
    const std::int32_t y = sensor_y(request, r);
    s.row = r;
    const Exposure when = exposure(request.row_times[static_cast<std::size_t>(r)], s);
    s.starlight.assign(width * scene.bands.size(), 0);
    const auto row_of = [&](std::span<float> plane) {
        return plane.empty() ? plane : plane.subspan(static_cast<std::size_t>(r) * width, width);
    };
    clear(row_of(request.samples));
    s.first_sampled = width;
    s.end_sampled = 0;
    // All 0: scale_variance() leaves it so.
    if (!request.variance.empty() && s.variance.size() != width) s.variance.assign(width, 0);
    s.light.assign(width * (plain ? 1 : scene.bands.size()), 0);
    const QualityLevel level = level_of(request, r);
    const Exposure traced = level >= QualityLevel::reprojected ? when : exposure_at(level, when.row, s);
    RowSetUp& set_up = traced.instants == when.instants ? s.whole : s.fewer;
    begin_rows(rows.request, traced, s, set_up);
    if (&set_up == &s.fewer) set_lens(set_up.rows[0].beta, s);
    s.work.row_set_up(when.instants);
    const Instants sampled(std::span(set_up.rows.data(), traced.instants));
    bool bodies_near = false;
    with_tracer(
        sampled, s,
        [&](Tracer& tracer) {
            bodies_near = trace_pixels(request, y, rows, sampled, set_up.swept, level, tracer, s);
        },
        level);
    begin_rows(rows.request, when, s, s.whole);
    const std::span states(s.whole.rows.data(), when.instants);
    if (level != QualityLevel::full && has_small(states)) {
        set_lens(states[0].beta, s);
        with_tracer(Instants(states), s,
                    [&](Tracer& tracer) { trace_small_bodies(request, y, Instants(states), tracer, s); });
    }
    if (request.keep != nullptr) keep_light(request, kept_y(request, r), when, s);
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
    if (!request.variance.empty()) scale_variance(s, row_of(request.variance));
    for (const StrayMap& map : stray)
        map.add(request.window.x, y, sun_at_camera(states.back()), scene.bands.size(), s.starlight);
    for (std::size_t b = 0; b < scene.bands.size(); ++b) {
        float* out =
            irradiance.data() +
            (b * static_cast<std::size_t>(plane_rows(request)) + static_cast<std::size_t>(r)) * width;
        const double* light = s.light.data() + (plain ? 0 : b * width);
        const double unit = plain ? sun_w_m2[b] : 1;
        for (std::size_t x = 0; x < width; ++x)
            out[x] = static_cast<float>((light[x] * unit + s.starlight[b * width + x]) * s.per_pixel[x]);
    }
    return {traced.instants, bodies_near ? level : QualityLevel::full};
}

void Renderer::Impl::reserve(Scratch& s, std::int32_t width) const {
    const auto pixels = static_cast<std::size_t>(width);
    for (std::size_t i = 0; i < settings.max_instants; ++i)
        begin_row(0, s, i);
    join_instants(s.whole.rows, s.whole.swept);
    s.motion_of_row.resize(pixels);
    s.light.reserve(pixels * scene.bands.size());
    s.starlight.reserve(pixels * scene.bands.size());
    s.per_pixel.reserve(pixels);
    s.variance.reserve(pixels);
    s.candidates.reserve(bodies.size());
    s.pins.reserve(terrains.size());
}

void Renderer::Impl::load_row(const RenderRequest& request, std::int32_t r, Scratch& s) const {
    for (const SurfaceTiles* const tiles : terrains)
        s.pins.push_back(tiles->pin());
    const RowState& row = begin_row(to_seconds(request.row_times[static_cast<std::size_t>(r)].mid().ns), s);
    if (resolves_any(row, field_rad))
        with_tracer(row, s, [&](Tracer& tracer) {
            // With some rays a pixel, what frames take at random is met.
            const Sampling how{settings.seed, request.frame_id, loading_samples};
            BlockTracer blocks(*s.lens, gaussian_psf, psf.get(), how, row, {}, tracer, s.candidates);
            const Region& window = request.window;
            const std::int32_t last = BlockTracer::block_of(window.x + window.width - 1);
            BlockResult unused;
            for (std::int32_t block = BlockTracer::block_of(window.x); block <= last; ++block)
                blocks.trace(block, window.y + request.first_row + r, unused);
        });
    s.pins.clear();
}

bool Renderer::Impl::load_tiles(const RenderRequest& request,
                                const std::function<bool(double)>& go_on) const {
    if (terrains.empty()) return true;
    if (!go_on(0)) return false;
    std::mutex mutex;
    std::condition_variable ended;
    unsigned working = threads; // with the mutex, as is `failure`
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
        for (unsigned i = 0; i < threads; ++i)
            workers.emplace_back(work);
        std::unique_lock lock(mutex);
        while (!ended.wait_for(lock, std::chrono::milliseconds(100), [&] { return working == 0; })) {
            lock.unlock();
            if (!go_on(static_cast<double>(done) / request.rows)) stop = true;
            lock.lock();
        }
    }
    for (const SurfaceTiles* const tiles : terrains)
        tiles->publish();
    if (failure) std::rethrow_exception(failure);
    if (!loaders.empty()) predict_views(request);
    return done == request.rows;
}

std::shared_ptr<ShapeCache> make_shape_cache() {
    return std::make_shared<ShapeCache>();
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

ReprojectionSource::ReprojectionSource(const Renderer& renderer, std::int32_t width, std::int32_t rows,
                                       std::size_t windows)
    : impl_(std::make_unique<Impl>(static_cast<std::size_t>(width), static_cast<std::size_t>(rows), windows,
                                   renderer.band_count(), renderer.impl_->bodies.size())) {}

Workspace::Workspace(const Renderer& renderer, std::int32_t width, std::int32_t rows)
    : impl_(std::make_unique<Impl>()) {
    renderer.impl_->reserve(impl_->scratch, width);
    // Rehearse: all rows as they were, and those in the middle reprojected, with one time and with several.
    const std::int32_t few = std::min(rows, 2 * quality_group_rows);
    ReprojectionSource light(renderer, width, rows);
    const Region area{0, 0, width, rows};
    std::vector<RowTime> times(static_cast<std::size_t>(rows));
    std::vector<QualityLevel> levels(times.size());
    std::vector<float> image(renderer.band_count() * times.size() * static_cast<std::size_t>(width));
    std::vector<float> samples(times.size() * static_cast<std::size_t>(width)), variance = samples;
    for (const std::int64_t between_rows_ns : {0, 1}) {
        for (std::size_t r = 0; r < times.size(); ++r) {
            const Time mid{static_cast<std::int64_t>(r) * between_rows_ns};
            times[r] = {mid, mid};
        }
        light.begin_frame(KeptWindow{area});
        const auto render = [&](QualityLevel level, std::int32_t first, std::int32_t count) {
            std::fill(levels.begin(), levels.end(), level);
            const auto of = [first, count](auto& all, std::size_t each = 1) {
                return std::span(all).subspan(static_cast<std::size_t>(first) * each,
                                              static_cast<std::size_t>(count) * each);
            };
            RenderRequest request;
            request.window = area;
            request.first_row = first;
            request.rows = count;
            request.row_times = of(times);
            request.common_mid = common_mid(times);
            request.levels = of(levels);
            request.frame_times = times;
            request.samples = of(samples, static_cast<std::size_t>(width));
            request.variance = of(variance, static_cast<std::size_t>(width));
            request.plane_rows = rows;
            request.alone = this;
            (level < QualityLevel::reprojected ? request.keep : request.from) = &light;
            static_cast<void>(renderer.render(request, image));
        };
        render(QualityLevel::sixteenth, 0, rows);
        render(QualityLevel::repeated, 0, rows);
        render(QualityLevel::reprojected, (rows - few) / 2, few);
    }
}

bool ReprojectionSource::complete(const Renderer& renderer) const noexcept {
    const auto windows = std::span(impl_->windows).first(impl_->placed.size());
    return impl_->kept_by == renderer.impl_->number && !windows.empty() &&
           std::all_of(windows.begin(), windows.end(),
                       [](const Impl::Window& window) { return window.image.complete(); });
}

bool Renderer::kept_motion_px(const RenderRequest& request, std::span<float> px,
                              const std::atomic<bool>* cancel) const {
    const ActiveCallGuard counted(impl_->under_way);
    assert(px.size() == static_cast<std::size_t>(request.rows));
    RowBlock& rows = impl_->block_scratch.local();
    rows.request = impl_->requests.fetch_add(1, std::memory_order_relaxed) + 1;
    if (!impl_->fill_motion(request, 0, request.rows - 1, cancel, rows)) return false;
    MotionGrid& motion = request.from->impl_->windows[request.kept_window].motion;
    for (std::int32_t r = 0; r < request.rows; ++r)
        px[static_cast<std::size_t>(r)] = motion.largest_px(Impl::kept_y(request, r));
    return true;
}

bool Renderer::Impl::render_line_by_line(const Renderer& self, const RenderRequest& request,
                                         std::span<float> irradiance, const std::atomic<bool>* cancel) const {
    const auto width = static_cast<std::size_t>(request.window.width);
    RenderRequest line = request;
    line.rows = 1;
    line.plane_rows = plane_rows(request);
    for (std::int32_t r = 0; r < request.rows; ++r) {
        const auto at = static_cast<std::size_t>(r);
        line.row_times = request.row_times.subspan(at, 1);
        if (!request.levels.empty()) line.levels = request.levels.subspan(at, 1);
        line.line = *request.line + r;
        if (!self.render(line, irradiance.subspan(at * width), cancel)) return false;
    }
    return true;
}

bool Renderer::load_tiles(const RenderRequest& request, const std::function<bool(double)>& go_on) const {
    return impl_->load_tiles(request, go_on);
}

std::uint64_t Renderer::tiles_made() const noexcept {
    std::uint64_t made = 0;
    for (const SurfaceTiles* const tiles : impl_->terrains) {
        made += tiles->made();
        if (tiles->sun_visibility() != nullptr) made += tiles->sun_visibility()->made();
    }
    return made;
}

std::vector<Renderer::TerrainTiles> Renderer::terrain_tiles() const {
    std::vector<TerrainTiles> out;
    for (const SurfaceTiles* const tiles : impl_->terrains) {
        const auto body = std::find_if(impl_->bodies.begin(), impl_->bodies.end(),
                                       [&](const BuiltBody& b) { return b.shape->tiles() == tiles; });
        const SurfaceTiles::Usage usage = tiles->usage();
        const auto number = static_cast<std::size_t>(body - impl_->bodies.begin());
        out.push_back({impl_->scene.bodies[number].name, usage.made, usage.slots});
    }
    return out;
}

bool Renderer::render(const RenderRequest& request, std::span<float> irradiance,
                      const std::atomic<bool>* cancel) const {
    const ActiveCallGuard counted(impl_->under_way);
    assert(request.plane_rows > 0 || irradiance.size() == band_count() *
                                                              static_cast<std::size_t>(request.rows) *
                                                              static_cast<std::size_t>(request.window.width));
    assert(request.rows >= 0 && request.row_times.size() == static_cast<std::size_t>(request.rows));
    assert(request.levels.empty() || request.levels.size() == request.row_times.size());
    assert(!request.line || (request.gate == nullptr && request.samples.empty() && request.variance.empty()));
    // The wings of each line are maps of their own: no more at a time than rows share.
    if (request.line && request.rows > 1 && impl_->wing_kernels)
        return impl_->render_line_by_line(*this, request, irradiance, cancel);
    RowBlock& rows = request.kept != nullptr    ? request.kept->impl_->rows
                     : request.alone != nullptr ? request.alone->impl_->rows
                                                : impl_->block_scratch.local();
    // Gates and kept light take rows as they come.
    rows.cancel = request.gate == nullptr && request.keep == nullptr ? cancel : nullptr;
    if (request.kept == nullptr || !rows.kept) {
        rows.request = impl_->requests.fetch_add(1, std::memory_order_relaxed) + 1;
        rows.kernel.reset();
        rows.sparse_begun = {};
        rows.kept = request.kept != nullptr;
        // What it keeps between frames refers to its renderer.
        if (std::exchange(rows.kept_by, impl_->number) != impl_->number) rows.wings.reset();
        if (!impl_->loaders.empty() && request.first_row == 0 && request.alone == nullptr) {
            for (const SurfaceTiles* const tiles : impl_->terrains)
                tiles->begin_frame(impl_->frame_key(request));
            impl_->predict_views(request);
        }
    }
    if (request.keep != nullptr) {
        ReprojectionSource::Impl& keep = *request.keep->impl_;
        assert(request.kept_window < keep.placed.size() &&
               keep.placed[request.kept_window].area.x == request.window.x &&
               keep.placed[request.kept_window].area.width == request.window.width);
        if (std::exchange(keep.kept_by, impl_->number) == 0)
            for (ReprojectionSource::Impl::Window& window : std::span(keep.windows).first(keep.placed.size()))
                window.image.begin(impl_->plain ? 1 : band_count(), impl_->bodies.size(),
                                   request.common_mid.has_value());
    }
    impl_->splatter.star_rows().assign(request.row_times, request.window, Impl::sensor_y(request, 0),
                                       request.line.has_value(), rows.stars);
    if (!impl_->fill_sample_grid(request, cancel, rows) ||
        !impl_->fill_sparse_grid(request, QualityLevel::grid, cancel, rows) ||
        !impl_->fill_sparse_grid(request, QualityLevel::quarter, cancel, rows) ||
        !impl_->fill_sparse_grid(request, QualityLevel::sixteenth, cancel, rows) ||
        !impl_->fill_motion(request, cancel, rows) || !impl_->fill_points(request, cancel, rows) ||
        !impl_->fill_wings(request, cancel, rows))
        return false;
    const auto render_row = [&](std::int32_t r, Scratch& s) {
        const RenderedRow how = impl_->render_row(request, rows, r, irradiance, s);
        if (request.gate != nullptr) request.gate->done(r, how);
    };
    if (request.gate == nullptr)
        return impl_->for_rows(RenderPart::rest, request.rows, impl_->rows_of(request), cancel, render_row);
    return impl_->for_rows(
        RenderPart::rest, request.rows, impl_->rows_of(request), cancel,
        [&](std::int32_t r) {
            return request.gate->wants(r) &&
                   impl_->grids_ready(request, rows, r, impl_->own_scratch(Impl::alone_scratch(request)));
        },
        render_row);
}

bool Renderer::has_level(QualityLevel level) const noexcept {
    switch (level) {
    case QualityLevel::goal:
        return impl_->settings.target_error > 0 || impl_->settings.samples_per_pixel > 1;
    case QualityLevel::instants:
        return impl_->settings.max_instants > 1;
    case QualityLevel::bounces:
        return impl_->lighting.max_bounces > 1;
    default:
        return level <= QualityLevel::sixteenth;
    }
}

std::uint32_t Renderer::bounces_at(QualityLevel level) const noexcept {
    return (level == QualityLevel::bounces ? impl_->lighting_few_bounces : impl_->lighting).max_bounces;
}

bool Renderer::render_aovs(const RenderRequest& request, std::span<float> aovs,
                           const std::atomic<bool>* cancel) const {
    const auto width = static_cast<std::size_t>(request.window.width);
    const std::size_t plane = static_cast<std::size_t>(request.rows) * width;
    assert(aovs.size() == aov_count * plane);
    return impl_->for_rows(
        RenderPart::rest, request.rows, impl_->rows_of(request), cancel, [&](std::int32_t r, Scratch& s) {
            const double time_s = to_seconds(request.row_times[static_cast<std::size_t>(r)].mid().ns);
            const RowState& row = impl_->begin_row(time_s, s);
            trace_aovs(*s.lens, row, request.window.x, request.window.y + request.first_row + r,
                       request.window.width, impl_->pixel_width_rad(), s.candidates,
                       aovs.data() + static_cast<std::size_t>(r) * width, plane);
        });
}

bool Renderer::intersect(Time t, std::span<const Ray> rays, std::span<double> distances_m,
                         const std::atomic<bool>* cancel) const {
    assert(distances_m.size() == rays.size());
    constexpr std::size_t at_once = 4096;
    const std::size_t blocks = (rays.size() + at_once - 1) / at_once;
    return impl_->for_rows(RenderPart::rest, static_cast<std::int32_t>(blocks), {}, cancel,
                           [&](std::int32_t block, Scratch& s) {
                               const std::size_t first = static_cast<std::size_t>(block) * at_once;
                               const std::size_t count = std::min(at_once, rays.size() - first);
                               std::vector<Vec3> origins, directions;
                               for (const Ray& ray : rays.subspan(first, count)) {
                                   origins.push_back(ray.origin_m);
                                   directions.push_back(normalized(ray.direction));
                               }
                               nearest_distances(impl_->begin_row(to_seconds(t.ns), s), origins, directions,
                                                 distances_m.subspan(first, count));
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

double Renderer::lamp_change_px(const GroundTruth& from, std::span<const Pose> from_lamps,
                                const GroundTruth& to, std::span<const Pose> to_lamps) const noexcept {
    return renderer::lamp_change_px(impl_->scene, impl_->bodies, *impl_->lens, from, from_lamps, to,
                                    to_lamps);
}

void Renderer::fill_lamps(Time t, std::span<Pose> lamps) const noexcept {
    const std::vector<scene::Lamp>& all = impl_->scene.lamps;
    for (std::size_t i = 0; i < std::min(lamps.size(), all.size()); ++i)
        lamps[i] = lamp_pose(impl_->scene, impl_->bodies, all[i], to_seconds(t.ns));
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
        impl_.with_tracer(scratch_.whole.rows[0], scratch_,
                          [&](Tracer& tracer) { trace(scratch_.whole.rows[0], tracer, light); });
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
    Scratch& scratch = impl_->scratch.local();
    TruthScene scene = impl_->truth_scene(in_view.stars, request.frame_id, common_mid(request.rows), scratch);
    Impl::TracedLight light(*impl_, scratch);
    scene.light = &light;
    renderer::list_truth(scene, request, truth);
    scratch.pins.clear();
    scratch.detail = {}; // not of a picture
}

/// Pins the tiles of the frame in `scratch`.
TruthScene Renderer::Impl::truth_scene(const FieldStars& stars, std::uint64_t frame_id,
                                       std::optional<Time> common, Scratch& s) const {
    s.frame = frame_key(frame_id, common);
    s.tile_versions.assign(bodies.size(), 0);
    for (std::size_t b = 0; b < bodies.size(); ++b)
        if (const SurfaceTiles* const tiles = bodies[b].shape->tiles(); tiles != nullptr)
            s.tile_versions[b] = tiles->version_of(s.frame);
    s.pins.clear();
    for (const SurfaceTiles* const tiles : terrains)
        s.pins.push_back(tiles->pin());
    return {scene,
            bodies,
            *lens,
            gaussian_psf,
            psf.get(),
            landmarks_m,
            stars,
            splatter.sky(),
            sun_w_m2,
            settings.max_instants,
            splatter.reach_px(),
            field_rad,
            s.tile_versions,
            settings.wait_for_tiles};
}

Overlay Renderer::overlay(const OverlayRequest& request) const {
    const std::lock_guard one_at_a_time(impl_->overlay_mutex);
    if (!impl_->overlay_memory) impl_->overlay_memory = std::make_unique<Impl::OverlayMemory>();
    auto& [in_view, scratch] = *impl_->overlay_memory;
    double more_rad = 0;
    if (!request.rows.empty()) {
        const double first_s = to_seconds(request.rows.front().mid().ns);
        const double last_s = to_seconds(request.rows.back().mid().ns);
        const auto attitude = [&](double t) {
            return camera_pose(impl_->scene, impl_->bodies, t).orientation;
        };
        const Quat turn = conjugate(attitude(first_s)) * attitude(last_s);
        more_rad = 2 * std::atan2(length({turn.x, turn.y, turn.z}), std::abs(turn.w)) +
                   2 * length(camera_beta(impl_->scene, impl_->bodies, first_s));
    }
    impl_->splatter.star_rows().find(request.truth.camera, more_rad, to_seconds(request.mid.ns), in_view);
    TruthScene scene = impl_->truth_scene(in_view.stars, request.frame_id, common_mid(request.rows), scratch);
    scene.max_instants = 1; // the middle of the exposure is near enough to the eye
    scene.poses = &request.truth;
    scene.poses_s = to_seconds(request.mid.ns);
    Overlay overlay = make_overlay(scene, request);
    scratch.pins.clear();
    return overlay;
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
    work.pixels_filled = impl_->pixels_filled.load(std::memory_order_relaxed);
    for (const BuiltBody& body : impl_->bodies)
        if (body.textures) work.tiles_missed += body.textures->missed_tiles();
    for (std::size_t k = 0; k < work.surface_coarser.size(); ++k)
        work.surface_coarser[k] = impl_->surface_coarser[k].load(std::memory_order_relaxed);
    return work;
}

} // namespace obscura::renderer
