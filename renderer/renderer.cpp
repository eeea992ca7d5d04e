#include "renderer/renderer.hpp"

#include "core/solar_spectrum.hpp"
#include "renderer/camera/aberration.hpp"
#include "renderer/camera/gaussian_psf.hpp"
#include "renderer/camera/projection.hpp"
#include "renderer/camera/psf.hpp"
#include "renderer/camera/stray_light.hpp"
#include "renderer/integrators/block_tracer.hpp"
#include "renderer/integrators/layers.hpp"
#include "renderer/integrators/path_tracer.hpp"
#include "renderer/integrators/sample_grid.hpp"
#include "renderer/integrators/tracer.hpp"
#include "renderer/lights/spectrum.hpp"
#include "renderer/lights/star_field.hpp"
#include "renderer/packets/sampler.hpp"
#include "renderer/packets/vector_math.hpp"
#include "renderer/world/build.hpp"
#include "renderer/world/exposure.hpp"
#include "renderer/world/kinematics.hpp"
#include "renderer/world/row_state.hpp"

#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#if defined(__SSE2__)
#include <pmmintrin.h>
#include <xmmintrin.h>
#endif

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <thread>
#include <vector>

namespace obscura::renderer {
namespace {

/// Denormals are flushed while rendering, as Embree asks; the thread's mode is put back at the end.
class FlushDenormals {
public:
#if defined(__SSE2__)
    FlushDenormals() : saved_(_mm_getcsr()) {
        _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
        _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
    }
    ~FlushDenormals() {
        _mm_setcsr(saved_);
    }

private:
    unsigned saved_;
#else
    FlushDenormals() = default;
    ~FlushDenormals() = default;

public:
#endif
    FlushDenormals(const FlushDenormals&) = delete;
    FlushDenormals& operator=(const FlushDenormals&) = delete;
};

/// What one thread needs to render a row; kept between rows so that nothing is allocated after the first.
struct Scratch {
    RowState row;
    std::optional<MovingLens> moving_lens; ///< with aberration
    const Projection* lens = nullptr;      ///< of the row: that one, or the camera's
    std::vector<double> light;             ///< channels x pixels, in the tracer's units, sr
    std::vector<double> starlight;         ///< bands x pixels, W/m2
    std::vector<double> per_pixel;         ///< from irradiance to the quantity asked for
    std::vector<std::int32_t> candidates;
    RayCounts counts;
    RowTime measured{}; ///< the exposure that `motion` belongs to
    double motion = 0;  ///< see motion_px()
};

/// What the rows of a band have in common.
struct Band {
    std::vector<std::uint32_t> stars;       ///< that some row may show
    std::optional<SampleGridKernel> kernel; ///< of `grid`; none: each pixel has samples of its own
    SampleGrid grid;
};

/// Whether any body is larger than pixels.
bool resolves_any(const RowState& row) {
    return std::any_of(row.bodies.begin(), row.bodies.end(), [](const BodyState& b) { return !b.targeted; });
}

} // namespace

struct Renderer::Impl {
    scene::Scene scene;
    RenderSettings settings;
    unsigned threads;
    std::unique_ptr<const Projection> lens;
    GaussianPsf gaussian_psf;
    std::unique_ptr<const Psf> psf; ///< if any, instead of the Gaussian
    std::vector<BuiltBody> bodies;
    StarField stars;
    std::vector<StrayMap> stray;
    std::vector<double> sun_w_m2; ///< per band, at 1 au
    Lighting lighting;
    bool plain = true; ///< the Sun is the only light, reflected once by grey surfaces: one channel does
    /// TBB has one worker per core; more threads than that must be asked for.
    std::optional<tbb::global_control> more_threads;
    mutable tbb::task_arena arena;
    mutable tbb::enumerable_thread_specific<Scratch> scratch;
    /// By the threads that call render().
    mutable tbb::enumerable_thread_specific<Band> band_scratch;
    mutable std::atomic<std::uint64_t> rays_done{0};
    mutable std::atomic<std::uint64_t> samples_done{0};

    Impl(scene::Scene s, RenderSettings r)
        : scene((validate(s), std::move(s))),
          settings(r),
          threads(r.threads > 0 ? r.threads : std::max(1u, std::thread::hardware_concurrency())),
          lens(make_projection(scene.camera)),
          gaussian_psf(scene.camera.psf_sigma_px),
          psf(Psf::make(scene.camera, scene.bands)),
          bodies(build_bodies(scene)),
          stars(scene.stars, scene.bands),
          stray(read_stray_light(scene)),
          arena(static_cast<int>(threads)) {
        if (threads > std::thread::hardware_concurrency())
            more_threads.emplace(tbb::global_control::max_allowed_parallelism, threads);
        settings.samples_per_pixel = std::max(1u, settings.samples_per_pixel);
        settings.max_instants = std::max(1u, settings.max_instants);
        settings.max_bounces = std::max(settings.max_bounces, scene.max_bounces);
        for (const SpectralBand& band : scene.bands)
            sun_w_m2.push_back(sun_irradiance_w_m2(band) * scene.sun.irradiance_scale);
        lighting = make_lighting(scene, bodies, sun_w_m2, settings.max_bounces);
        plain = settings.max_bounces == 0 && scene.lamps.empty() && !(psf && psf->chromatic()) &&
                std::all_of(bodies.begin(), bodies.end(), [](const BuiltBody& b) {
                    return b.colour.empty() && b.emission.empty() && (!b.textures || b.textures->grey());
                });
    }

    /// Calls `do_row(r, scratch)` for rows [0, rows) on the workers; false when cancelled.
    template<typename DoRow>
    bool for_rows(std::int32_t rows, const std::atomic<bool>* cancel, const DoRow& do_row) const;
    /// The Sun's irradiance at a place over that at 1 au.
    [[nodiscard]] double sun_at_camera(Vec3 place_m) const {
        const double distance = length(scene.sun.position_m - place_m) / astronomical_unit_m;
        return scene.sun.irradiance_scale / (distance * distance);
    }
    /// The instants that row `y` of the sensor is rendered at.
    [[nodiscard]] Exposure exposure(const RenderRequest& request, const RowTime& row, std::int32_t y,
                                    Scratch& s) const {
        if (settings.max_instants > 1 && s.measured != row) {
            s.measured = row;
            s.motion = motion_px(scene, bodies, *lens, splat_reach_px(), row);
        }
        const double chance =
            seed_words(settings.seed, request.frame_id, SamplePurpose::instant, 0, y)[0] * 0x1p-32;
        // Adaptive sampling takes what it needs, two for each instant at least.
        const std::uint32_t samples = settings.target_error > 0
                                          ? std::max(1u, settings.max_samples_per_pixel / 2)
                                          : settings.samples_per_pixel;
        return Exposure::of(row, s.motion, settings.max_instants, samples, chance);
    }
    /// Sets the row's state and lens. `parts`: instants that share the samples of its pixels.
    void begin_row(double time_s, std::uint32_t parts, Scratch& s) const {
        s.lens = lens.get();
        const Vec3 beta = camera_beta(scene, bodies, time_s);
        if (length(beta) > 0) s.lens = &s.moving_lens.emplace(*lens, beta);
        const std::uint32_t least = parts > 1 && settings.target_error > 0 ? 2 : 1;
        set_row_state(scene, bodies, *s.lens, sample_reach_px(),
                      std::max(least, settings.samples_per_pixel / parts), parts, time_s, s.row);
    }
    void find_stars(const RenderRequest& request, std::vector<std::uint32_t>& found) const;
    /// Calls `use(tracer)` with the tracer that the scene needs.
    template<typename Use>
    void with_tracer(Scratch& s, const Use& use) const;
    /// Whether the rows can share one grid of samples: they see one instant.
    [[nodiscard]] bool shares_samples(const RenderRequest& request, Scratch& s) const;
    bool fill_sample_grid(const RenderRequest& request, const std::atomic<bool>* cancel, Band& band) const;
    void render_row(const RenderRequest& request, const Band& band, std::int32_t r,
                    std::span<float> irradiance, Scratch& s) const;
    /// Adds the light of the row's instant, number `part` of `parts` that share the samples of pixels.
    void trace_pixels(const RenderRequest& request, std::int32_t y, const Band& band, std::uint32_t part,
                      std::uint32_t parts, Tracer& tracer, Scratch& s) const;
    /// Adds the light of stars and of bodies that are splatted at the row's instant, number `part` of
    /// `parts`.
    void splat(const RenderRequest& request, std::int32_t y, const Band& band, std::uint32_t part,
               std::uint32_t parts, Tracer& tracer, Scratch& s) const;
    [[nodiscard]] Sampling sampling(const RenderRequest& request, std::uint32_t part = 0,
                                    std::uint32_t parts = 1) const {
        // The parts' errors add up like chance, and their mean is taken.
        return {settings.seed, request.frame_id, (settings.max_samples_per_pixel + parts - 1) / parts,
                settings.target_error * std::sqrt(parts), part};
    }
    /// The farthest that a camera sample is displaced, along an axis.
    [[nodiscard]] double sample_reach_px() const { return psf ? psf->reach_px() : gaussian_psf.reach_px(); }
    /// The farthest that a point of light is seen from where it is projected.
    [[nodiscard]] double splat_reach_px() const {
        return psf ? std::max(psf->reach_px(), psf->wings_px()) : gaussian_psf.splat_reach_px();
    }
    enum class SplatParts : std::uint8_t { all, wings };
    /// Adds what row `y` gets of the light `amount`, by channel, of a point.
    void splat_point(const RenderRequest& request, std::int32_t y, ImagePoint at,
                     std::span<const double> amount, SplatParts parts, std::vector<double>& light) const;
    void splat_body(const RenderRequest& request, std::int32_t y, std::int32_t body, SplatParts splat_parts,
                    std::uint32_t part, std::uint32_t parts, Tracer& tracer, Scratch& s) const;
    void splat_stars(const RenderRequest& request, std::int32_t y, const std::vector<std::uint32_t>& in_view,
                     std::uint32_t parts, Tracer& tracer, Scratch& s) const;
};

template<typename DoRow>
bool Renderer::Impl::for_rows(std::int32_t row_count, const std::atomic<bool>* cancel,
                              const DoRow& do_row) const {
    std::atomic<bool> complete{true};
    const auto do_rows = [&](std::int32_t begin, std::int32_t end, Scratch& local) {
        const FlushDenormals flush;
        for (std::int32_t r = begin; r != end; ++r) {
            if (cancel != nullptr && cancel->load(std::memory_order_relaxed)) {
                complete.store(false, std::memory_order_relaxed);
                return;
            }
            do_row(r, local);
            // Row by row, because a supervisor takes these for signs of life.
            rays_done.fetch_add(local.counts.rays, std::memory_order_relaxed);
            samples_done.fetch_add(local.counts.samples, std::memory_order_relaxed);
            local.counts = {};
        }
    };
#ifdef __SANITIZE_THREAD__
    // ThreadSanitizer cannot look into TBB: it would report every fork and join of it, or, those suppressed,
    // nothing that rows share. Plain threads show it the rows.
    std::vector<std::jthread> workers;
    const auto first_row_of = [&](unsigned worker) {
        return static_cast<std::int32_t>(static_cast<std::int64_t>(row_count) * worker / threads);
    };
    for (unsigned i = 0; i < threads; ++i)
        workers.emplace_back([&, i] {
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

void Renderer::Impl::find_stars(const RenderRequest& request, std::vector<std::uint32_t>& found) const {
    found.clear();
    if (stars.size() == 0 || request.row_times.empty()) return;
    // The field at the middle row, grown by the largest turn of the camera within the band.
    const auto attitude = [&](Time t) { return camera_pose(scene, bodies, to_seconds(t.ns)).orientation; };
    const Quat middle = attitude(request.row_times[request.row_times.size() / 2].mid());
    double turn_rad = 0;
    double moved_rad = 0; // by aberration
    const RowTime* before = nullptr;
    for (const RowTime& t : request.row_times) {
        if (before != nullptr && *before == t) continue; // a global shutter has one time for all rows
        before = &t;
        for (const Time edge : {t.reset, t.mid(), t.read}) {
            const double cosine = std::min(1.0, std::abs(dot(middle, attitude(edge))));
            turn_rad = std::max(turn_rad, 2 * std::acos(cosine));
        }
        if (scene.aberration)
            moved_rad = std::max(moved_rad, 2 * length(camera_beta(scene, bodies, to_seconds(t.mid().ns))));
    }
    stars.inside(rotate(middle, {0, 0, 1}),
                 lens->field_angle_rad(splat_reach_px() + 1) + turn_rad + moved_rad + 1e-9, found);
}

template<typename Use>
void Renderer::Impl::with_tracer(Scratch& s, const Use& use) const {
    const double ray_width_rad = lens->pixel_angle_rad() / std::sqrt(settings.samples_per_pixel);
    if (plain) {
        Tracer tracer(s.row, scene.sun, s.counts);
        tracer.set_ray_width(ray_width_rad);
        use(tracer);
    } else {
        PathTracer tracer(s.row, lighting, scene.sun, s.counts);
        tracer.set_ray_width(ray_width_rad);
        use(tracer);
    }
}

bool Renderer::Impl::shares_samples(const RenderRequest& request, Scratch& s) const {
    // More than two samples a pixel are somebody's wish.
    return settings.target_error > 0 && settings.samples_per_pixel <= 2 && !psf &&
           SampleGridKernel::fits(gaussian_psf) &&
           std::all_of(request.row_times.begin(), request.row_times.end(), [&](const RowTime& t) {
               return t.mid() == request.row_times.front().mid() && exposure(request, t, 0, s).points == 1;
           });
}

bool Renderer::Impl::fill_sample_grid(const RenderRequest& request, const std::atomic<bool>* cancel,
                                      Band& band) const {
    band.kernel.reset();
    if (request.rows == 0 || !shares_samples(request, scratch.local())) return true;
    band.kernel.emplace(gaussian_psf, settings.seed, request.frame_id);
    SampleGrid& grid = band.grid;
    grid.reset(request.window, request.first_row, request.rows, plain ? 1 : scene.bands.size(),
               band.kernel->reach);
    const double time_s = to_seconds(request.row_times.front().mid().ns);
    return for_rows(grid.height(), cancel, [&](std::int32_t r, Scratch& s) {
        begin_row(time_s, 1, s);
        if (!resolves_any(s.row)) return;
        with_tracer(s, [&](Tracer& tracer) {
            const Sampling how = sampling(request);
            BlockTracer blocks(*s.lens, gaussian_psf, psf.get(), how, s.row, tracer, s.candidates);
            const std::int32_t first = BlockTracer::block_of(grid.first_x());
            for (std::int32_t block = 0; block < grid.width() / packet_size; ++block)
                blocks.trace_grid(first + block, grid.first_y() + r, *band.kernel, grid);
        });
    });
}

void Renderer::Impl::trace_pixels(const RenderRequest& request, std::int32_t y, const Band& band,
                                  std::uint32_t part, std::uint32_t parts, Tracer& tracer, Scratch& s) const {
    if (!resolves_any(s.row)) return;
    const auto width = static_cast<std::size_t>(request.window.width);
    const Sampling how = sampling(request, part, parts);
    const double share = 1.0 / parts;
    BlockTracer blocks(*s.lens, gaussian_psf, psf.get(), how, s.row, tracer, s.candidates);
    const std::int32_t last = BlockTracer::block_of(request.window.x + request.window.width - 1);
    for (std::int32_t block = BlockTracer::block_of(request.window.x); block <= last; ++block) {
        BlockResult result;
        if (!blocks.trace(block, y, result, band.kernel ? &*band.kernel : nullptr,
                          band.kernel ? &band.grid : nullptr))
            continue;
        for (int i = 0; i < packet_size; ++i) {
            const std::int32_t column = block * packet_size + i - request.window.x;
            if (!result.covered[i] || column < 0 || column >= request.window.width) continue;
            const auto pixel = static_cast<std::size_t>(column);
            for (std::size_t c = 0; c < tracer.channels(); ++c)
                s.light[c * width + pixel] += share * result.mean[c][i];
            const std::size_t at =
                static_cast<std::size_t>(y - request.window.y - request.first_row) * width + pixel;
            if (!request.samples.empty()) request.samples[at] += static_cast<float>(result.samples[i]);
            if (!request.variance.empty())
                request.variance[at] += static_cast<float>(share * share * result.variance[i]);
        }
    }
}

void Renderer::Impl::splat_point(const RenderRequest& request, std::int32_t y, ImagePoint at,
                                 std::span<const double> amount, SplatParts parts,
                                 std::vector<double>& light) const {
    const auto width = static_cast<std::size_t>(request.window.width);
    const auto over = [&](double half, const auto& share) {
        const auto from = std::max(request.window.x, static_cast<std::int32_t>(std::floor(at.x - half)));
        const auto to = std::min(request.window.x + request.window.width - 1,
                                 static_cast<std::int32_t>(std::ceil(at.x + half)));
        for (std::int32_t column = from; column <= to; ++column)
            for (std::size_t c = 0; c < amount.size(); ++c)
                light[c * width + static_cast<std::size_t>(column - request.window.x)] +=
                    amount[c] * share(column, c);
    };
    const double dy = y - at.y;
    if (!psf) {
        const double row_share = gaussian_psf.weight(at.y, y);
        if (row_share == 0) return;
        over(gaussian_psf.splat_reach_px(),
             [&](std::int32_t column, std::size_t) { return row_share * gaussian_psf.weight(at.x, column); });
        return;
    }
    if (parts == SplatParts::all && std::abs(dy) < psf->reach_px())
        over(psf->reach_px(),
             [&](std::int32_t column, std::size_t c) { return psf->weight(at, column, y, c); });
    const double rest2 = psf->wings_px() * psf->wings_px() - dy * dy;
    if (rest2 > 0)
        over(std::sqrt(rest2), [&](std::int32_t column, std::size_t c) {
            const double dx = column - at.x;
            return psf->wing(c, dx * dx + dy * dy);
        });
}

void Renderer::Impl::splat(const RenderRequest& request, std::int32_t y, const Band& band, std::uint32_t part,
                           std::uint32_t parts, Tracer& tracer, Scratch& s) const {
    for (std::size_t b = 0; b < s.row.bodies.size(); ++b)
        if (s.row.bodies[b].targeted)
            splat_body(request, y, static_cast<std::int32_t>(b), SplatParts::all, part, parts, tracer, s);
        else if (psf && psf->wings_px() > 0)
            splat_body(request, y, static_cast<std::int32_t>(b), SplatParts::wings, part, parts, tracer, s);
    splat_stars(request, y, band.stars, parts, tracer, s);
}

void Renderer::Impl::splat_body(const RenderRequest& request, std::int32_t y, std::int32_t index,
                                SplatParts splat_parts, std::uint32_t part, std::uint32_t parts,
                                Tracer& tracer, Scratch& s) const {
    const BodyState& body = s.row.bodies[static_cast<std::size_t>(index)];
    const double sine = body.cone_sine;
    std::uint32_t samples = samples_per_target;
    if (splat_parts == SplatParts::all) {
        const auto centre = s.lens->project(body.direction);
        if (!centre) return;
        const double reach = splat_reach_px() + 2 * targeted_radius_px;
        if (std::abs(centre->y - y) > reach || centre->x < request.window.x - reach ||
            centre->x > request.window.x + request.window.width - 1 + reach)
            return;
    } else {
        if (body.cos_cone < 0) return; // the camera is inside
        const double away = std::acos(std::clamp(body.direction.z, -1.0, 1.0));
        if (away > std::asin(sine) + s.lens->field_angle_rad(splat_reach_px() + 1)) return;
        // Points closer to each other than what the wings, which begin at half the core, could show.
        const double spacing_rad = psf->reach_px() / 4 * s.lens->local_pixel_angle_rad(body.direction);
        const double wanted = body.solid_angle_sr / (spacing_rad * spacing_rad);
        samples = 256;
        while (samples < 4096 && samples < wanted)
            samples *= 2;
    }

    // The instants share them. Fewer would leave out too much of the body.
    if (parts > 1) samples = std::bit_floor(std::max(64u, samples / parts));

    // Every body whose cone meets this one's can hide it.
    s.candidates.clear();
    for (std::size_t b = 0; b < s.row.bodies.size(); ++b) {
        const BodyState& other = s.row.bodies[b];
        const double reach_cos = body.cos_cone * other.cos_cone - sine * other.cone_sine;
        if (static_cast<std::int32_t>(b) == index || other.cos_cone < 0 ||
            dot(other.direction, body.direction) >= reach_cos)
            s.candidates.push_back(static_cast<std::int32_t>(b));
    }
    Vec3 e1;
    Vec3 e2;
    orthonormal_basis(body.direction, e1, e2);
    const double one_minus_cos = sine * sine / (1 + body.cos_cone);
    const SeedWords seeds = seed_words(settings.seed, request.frame_id, SamplePurpose::body, index, 0);
    const double weight = body.solid_angle_sr / samples / parts;
    tracer.set_ray_width(std::sqrt(weight));
    for (std::uint32_t first = part * samples; first < (part + 1) * samples; first += packet_size) {
        CameraRays rays;
        Words seed0;
        for (std::uint32_t i = 0; i < packet_size; ++i) {
            rays.index.v[i] = first + i;
            seed0.v[i] = seeds[0];
            rays.light_seed.v[i] = seeds[1];
        }
        Doubles u;
        Doubles v;
        sobol_pair(rays.index, seed0, u, v);
        Lanes active;
        for (int i = 0; i < packet_size; ++i) {
            const double h = u.v[i] * one_minus_cos;
            const double sin_theta = std::sqrt(h * (2 - h));
            double sin_phi;
            double cos_phi;
            sincos_turn(v.v[i], sin_phi, cos_phi);
            rays.direction.set(i, body.direction * (1 - h) + (e1 * cos_phi + e2 * sin_phi) * sin_theta);
            active.on[i] = -1;
        }
        tracer.intersect(rays.direction, active, s.candidates, rays.hits);
        tracer.count_samples(active);
        for (std::int32_t& hit : rays.hits.body)
            hit = hit == index ? hit : -1;
        tracer.radiance({&rays, 1});
        for (int i = 0; i < packet_size; ++i) {
            if (rays.hits.body[i] < 0) continue;
            const Vec3 direction = rays.direction.lane(i);
            const auto at = s.lens->project(direction);
            if (!at) continue;
            const double dim = weight * s.lens->transmission(direction);
            double amount[max_channels];
            for (std::size_t c = 0; c < tracer.channels(); ++c)
                amount[c] = dim * rays.radiance.v[c].v[i];
            splat_point(request, y, *at, {amount, tracer.channels()}, splat_parts, s.light);
        }
    }
}

void Renderer::Impl::splat_stars(const RenderRequest& request, std::int32_t y,
                                 const std::vector<std::uint32_t>& in_view, std::uint32_t parts,
                                 Tracer& tracer, Scratch& s) const {
    const double reach = splat_reach_px();
    for (const std::uint32_t star : in_view) {
        const Vec3 direction = s.row.camera_from_inertial * stars.direction(star);
        const auto at = s.lens->project(direction);
        if (!at || std::abs(at->y - y) > reach || at->x < request.window.x - reach ||
            at->x > request.window.x + request.window.width - 1 + reach)
            continue;
        s.candidates.clear();
        for (std::size_t b = 0; b < s.row.bodies.size(); ++b)
            if (dot(direction, s.row.bodies[b].direction) >= s.row.bodies[b].cos_cone - 1e-12)
                s.candidates.push_back(static_cast<std::int32_t>(b));
        if (!s.candidates.empty()) {
            Vec3s directions;
            Lanes active{};
            for (int i = 0; i < packet_size; ++i)
                directions.set(i, direction);
            active.on[0] = -1;
            HitPacket hits;
            tracer.intersect(directions, active, s.candidates, hits);
            if (hits.body[0] >= 0) continue;
        }
        const double through = s.lens->transmission(direction) / parts;
        double amount[max_channels];
        for (std::size_t band = 0; band < scene.bands.size(); ++band)
            amount[band] = through * stars.irradiance(star, band);
        splat_point(request, y, *at, {amount, scene.bands.size()}, SplatParts::all, s.starlight);
    }
}

void Renderer::Impl::render_row(const RenderRequest& request, const Band& band, std::int32_t r,
                                std::span<float> irradiance, Scratch& s) const {
    const auto width = static_cast<std::size_t>(request.window.width);
    const std::int32_t y = request.window.y + request.first_row + r;
    const Exposure when = exposure(request, request.row_times[static_cast<std::size_t>(r)], y, s);
    s.starlight.assign(width * scene.bands.size(), 0);
    const auto row_of = [&](std::span<float> plane) {
        return plane.empty() ? plane : plane.subspan(static_cast<std::size_t>(r) * width, width);
    };
    for (const std::span<float> plane : {row_of(request.samples), row_of(request.variance)})
        std::fill(plane.begin(), plane.end(), 0.0F);
    s.light.assign(width * (plain ? 1 : scene.bands.size()), 0);
    const bool together = when.pixels == when.points;
    for (std::uint32_t i = 0; i < when.points; ++i) {
        begin_row(when.point_s(i), when.pixels, s);
        with_tracer(s, [&](Tracer& tracer) {
            if (together) trace_pixels(request, y, band, i, when.pixels, tracer, s);
            splat(request, y, band, i, when.points, tracer, s);
        });
    }
    for (std::uint32_t i = 0; !together && i < when.pixels; ++i) {
        begin_row(when.pixel_s(i), when.pixels, s);
        with_tracer(s, [&](Tracer& tracer) { trace_pixels(request, y, band, i, when.pixels, tracer, s); });
    }
    s.per_pixel.assign(width, 1);
    if (scene.quantity == scene::Quantity::radiance)
        for (std::size_t x = 0; x < width; ++x) {
            const double solid_angle_sr = lens->solid_angle_sr(request.window.x + static_cast<double>(x), y);
            s.per_pixel[x] = solid_angle_sr > 0 ? 1 / solid_angle_sr : 0;
        }
    if (!request.variance.empty()) {
        const double unit = plain ? std::accumulate(sun_w_m2.begin(), sun_w_m2.end(), 0.0) /
                                        static_cast<double>(sun_w_m2.size())
                                  : 1;
        const std::span<float> row = row_of(request.variance);
        for (std::size_t x = 0; x < width; ++x) {
            const double scale = unit * s.per_pixel[x];
            row[x] = static_cast<float>(static_cast<double>(row[x]) * scale * scale);
        }
    }
    for (const StrayMap& map : stray)
        map.add(request.window.x, y, sun_at_camera(s.row.camera.position_m), scene.bands.size(), s.starlight);
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
    Band& band = impl_->band_scratch.local();
    impl_->find_stars(request, band.stars);
    return impl_->fill_sample_grid(request, cancel, band) &&
           impl_->for_rows(request.rows, cancel, [&](std::int32_t r, Scratch& scratch) {
               impl_->render_row(request, band, r, irradiance, scratch);
           });
}

bool Renderer::render_layers(const RenderRequest& request, std::span<float> layers,
                             const std::atomic<bool>* cancel) const {
    const auto width = static_cast<std::size_t>(request.window.width);
    const std::size_t plane = static_cast<std::size_t>(request.rows) * width;
    assert(layers.size() == layer_count * plane);
    return impl_->for_rows(request.rows, cancel, [&](std::int32_t r, Scratch& s) {
        const double time_s = to_seconds(request.row_times[static_cast<std::size_t>(r)].mid().ns);
        impl_->begin_row(time_s, 1, s);
        trace_layers(*s.lens, s.row, request.window.x, request.window.y + request.first_row + r,
                     request.window.width, impl_->lens->pixel_angle_rad(), s.candidates,
                     layers.data() + static_cast<std::size_t>(r) * width, plane);
    });
}

const char* layer_name(LayerId layer) {
    constexpr std::array<const char*, layer_count> names{"body",
                                                         "range_m",
                                                         "depth_m",
                                                         "normal.x",
                                                         "normal.y",
                                                         "normal.z",
                                                         "latitude_deg",
                                                         "longitude_deg",
                                                         "slope_deg",
                                                         "incidence_deg",
                                                         "emission_deg",
                                                         "phase_deg",
                                                         "u",
                                                         "v",
                                                         "albedo",
                                                         "material"};
    return names[static_cast<std::size_t>(layer)];
}

void Renderer::fill_truth(Time t, GroundTruth& truth) const noexcept {
    const double time_s = to_seconds(t.ns);
    truth.mid_exposure = t;
    truth.camera = camera_pose(impl_->scene, impl_->bodies, time_s);
    truth.sun_position_m = impl_->scene.sun.position_m;
    truth.seed = impl_->settings.seed;
    const auto& bodies = impl_->scene.bodies;
    truth.body_count = static_cast<std::uint32_t>(std::min(bodies.size(), max_truth_bodies));
    for (std::uint32_t i = 0; i < truth.body_count; ++i) {
        BodyTruth& body = truth.bodies[i];
        body.name.fill('\0');
        const std::string& name = bodies[i].name;
        std::copy_n(name.begin(), std::min(name.size(), body.name.size() - 1), body.name.begin());
        body.pose = seen_pose(impl_->scene, impl_->bodies, i, truth.camera.position_m, time_s);
    }
}

std::uint64_t Renderer::rays_traced() const noexcept {
    return impl_->rays_done.load(std::memory_order_relaxed);
}

std::uint64_t Renderer::samples_taken() const noexcept {
    return impl_->samples_done.load(std::memory_order_relaxed);
}

} // namespace obscura::renderer
