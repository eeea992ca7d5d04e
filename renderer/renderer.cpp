// SPDX-License-Identifier: Apache-2.0
#include "renderer/renderer.hpp"

#include "renderer/integrators/aovs.hpp"
#include "renderer/integrators/ray_query.hpp"
#include "renderer/passes/built_scene.hpp"
#include "renderer/passes/grid_pass.hpp"
#include "renderer/passes/kept_light.hpp"
#include "renderer/passes/pass_request.hpp"
#include "renderer/passes/point_pass.hpp"
#include "renderer/passes/reprojection_pass.hpp"
#include "renderer/passes/row_block.hpp"
#include "renderer/passes/row_pass.hpp"
#include "renderer/passes/row_scheduler.hpp"
#include "renderer/passes/row_set_up.hpp"
#include "renderer/passes/scan_pass.hpp"
#include "renderer/passes/scratch.hpp"
#include "renderer/passes/tile_loading.hpp"
#include "renderer/passes/truth_pass.hpp"
#include "renderer/passes/wing_pass.hpp"
#include "renderer/registries/shape_cache.hpp"
#include "renderer/world/exposure.hpp"
#include "renderer/world/kinematics.hpp"
#include "renderer/world/lamp_change.hpp"
#include "renderer/world/view.hpp"

#include <oneapi/tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <atomic>
#include <cassert>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace obscura::renderer {

struct FrameSamples::Impl {
    RowBlock rows;
};
FrameSamples::FrameSamples() : impl_(std::make_unique<Impl>()) {}
FrameSamples::~FrameSamples() = default;
void FrameSamples::begin_frame() noexcept {
    impl_->rows.kept = false;
}

struct ReprojectionSource::Impl {
    KeptLight light;
};
ReprojectionSource::~ReprojectionSource() = default;
bool ReprojectionSource::begin_frame(std::span<const KeptWindow> windows) noexcept {
    return impl_->light.begin_frame(windows);
}
std::span<const KeptWindow> ReprojectionSource::windows() const noexcept {
    return impl_->light.placed;
}
void ReprojectionSource::begin_reprojection() noexcept {
    for (KeptLight::Window& window : impl_->light.placed_windows())
        window.motion.restart();
}

struct Workspace::Impl {
    Scratch scratch;
    RowBlock rows;
};
Workspace::~Workspace() = default;

struct Renderer::Impl {
    Impl(scene::Scene scene, RenderSettings settings)
        : built(std::move(scene), std::move(settings)), tiles(built), workers(built) {
        built.set_lighting();
    }

    BuiltScene built;
    TileLoading tiles;
    RowScheduler workers;
    /// Per thread that calls render().
    mutable tbb::enumerable_thread_specific<RowBlock> block_scratch;
    std::uint64_t number = next_number.fetch_add(1); ///< of this renderer, for what others keep
    static inline std::atomic<std::uint64_t> next_number{1};
    mutable std::atomic<std::uint64_t> requests{0};
    mutable std::mutex overlay_mutex;
    mutable std::unique_ptr<TruthMemory> overlay_memory; ///< null: no overlay has been asked for

    /// Frame key and, for single-threaded requests, the scratch buffer.
    [[nodiscard]] RowsOf rows_of(const RenderRequest& request) const {
        return {tiles.frame_key(request.frame_id, request.common_mid),
                request.alone != nullptr ? &request.alone->impl_->scratch : nullptr};
    }
    [[nodiscard]] PassRequest pass_of(const RenderRequest& request) const {
        PassRequest pass{request, rows_of(request),
                         request.keep != nullptr ? &request.keep->impl_->light : nullptr,
                         request.from != nullptr ? &request.from->impl_->light : nullptr};
        if (request.pixel_times) {
            pass.common_mid.reset();
            pass.levels = {};
            pass.keep = pass.from = nullptr;
            pass.keep_light = pass.from_light = nullptr;
        }
        return pass;
    }
    /// The memory that the request's rows share, with what it keeps of the frame's earlier requests.
    RowBlock& block_of(const RenderRequest& request) const;
    /// Begins the light that the request keeps, unless an earlier one has.
    void begin_keeping(const PassRequest& request) const;
    /// Renders each line of a push-broom sensor by a request of its own.
    bool render_line_by_line(const Renderer& self, const RenderRequest& request, std::span<float> irradiance,
                             const std::atomic<bool>* cancel) const;
};

std::shared_ptr<ShapeCache> make_shape_cache() {
    return std::make_shared<ShapeCache>();
}

Renderer::Renderer(scene::Scene scene, RenderSettings settings)
    : impl_(std::make_unique<Impl>(std::move(scene), std::move(settings))) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

const scene::Scene& Renderer::scene() const noexcept {
    return impl_->built.scene;
}

std::size_t Renderer::band_count() const noexcept {
    return impl_->built.scene.bands.size();
}

ReprojectionSource::ReprojectionSource(const Renderer& renderer, std::int32_t width, std::int32_t rows,
                                       std::size_t windows)
    : impl_(new Impl{{static_cast<std::size_t>(width), static_cast<std::size_t>(rows), windows,
                      renderer.band_count(), renderer.impl_->built.bodies.size()}}) {}

Workspace::Workspace(const Renderer& renderer, std::int32_t width, std::int32_t rows)
    : impl_(std::make_unique<Impl>()) {
    reserve(renderer.impl_->built, impl_->scratch, width);
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
    const auto windows = impl_->light.placed_windows();
    return impl_->light.kept_by == renderer.impl_->number && !windows.empty() &&
           std::all_of(windows.begin(), windows.end(),
                       [](const KeptLight::Window& window) { return window.image.complete(); });
}

RowBlock& Renderer::Impl::block_of(const RenderRequest& request) const {
    RowBlock& rows = request.kept != nullptr    ? request.kept->impl_->rows
                     : request.alone != nullptr ? request.alone->impl_->rows
                                                : block_scratch.local();
    if (request.kept == nullptr || !rows.kept) {
        rows.request = requests.fetch_add(1, std::memory_order_relaxed) + 1;
        rows.kernel.reset();
        rows.sparse_begun = {};
        rows.kept = request.kept != nullptr;
        // What it keeps between frames refers to its renderer.
        if (std::exchange(rows.kept_by, number) != number) rows.wings.reset();
        if (request.first_row == 0 && request.alone == nullptr) tiles.begin_frame(request);
    }
    return rows;
}

void Renderer::Impl::begin_keeping(const PassRequest& request) const {
    KeptLight& keep = *request.keep_light;
    assert(request.kept_window < keep.placed.size() &&
           keep.placed[request.kept_window].area.x == request.window.x &&
           keep.placed[request.kept_window].area.width == request.window.width);
    if (std::exchange(keep.kept_by, number) != 0) return;
    for (KeptLight::Window& window : keep.placed_windows())
        window.image.begin(built.channels(), built.bodies.size(), request.common_mid.has_value());
}

bool Renderer::Impl::render_line_by_line(const Renderer& self, const RenderRequest& request,
                                         std::span<float> irradiance, const std::atomic<bool>* cancel) const {
    const auto width = static_cast<std::size_t>(request.window.width);
    RenderRequest line = request;
    line.rows = 1;
    line.plane_rows = request.plane_rows > 0 ? request.plane_rows : request.rows;
    for (std::int32_t r = 0; r < request.rows; ++r) {
        const auto at = static_cast<std::size_t>(r);
        line.row_times = request.row_times.subspan(at, 1);
        if (!request.levels.empty()) line.levels = request.levels.subspan(at, 1);
        line.line = *request.line + r;
        if (!self.render(line, irradiance.subspan(at * width), cancel)) return false;
    }
    return true;
}

bool Renderer::kept_motion_px(const RenderRequest& request, std::span<float> px,
                              const std::atomic<bool>* cancel) const {
    const TileLoading::ActiveCallGuard counted(impl_->tiles);
    assert(px.size() == static_cast<std::size_t>(request.rows));
    RowBlock& rows = impl_->block_scratch.local();
    rows.request = impl_->requests.fetch_add(1, std::memory_order_relaxed) + 1;
    const PassRequest pass = impl_->pass_of(request);
    if (!fill_motion(impl_->workers, pass, 0, request.rows - 1, cancel, rows)) return false;
    MotionGrid& motion = pass.from_window().motion;
    for (std::int32_t r = 0; r < request.rows; ++r)
        px[static_cast<std::size_t>(r)] = motion.largest_px(pass.kept_y(r));
    return true;
}

bool Renderer::load_tiles(const RenderRequest& request, const std::function<bool(double)>& go_on) const {
    return impl_->tiles.load(request, go_on);
}

std::uint64_t Renderer::tiles_made() const noexcept {
    return impl_->tiles.made();
}

std::vector<Renderer::TerrainTiles> Renderer::terrain_tiles() const {
    return impl_->tiles.usage();
}

bool Renderer::render(const RenderRequest& request, std::span<float> irradiance,
                      const std::atomic<bool>* cancel) const {
    const TileLoading::ActiveCallGuard counted(impl_->tiles);
    const BuiltScene& built = impl_->built;
    const RowScheduler& workers = impl_->workers;
    assert(request.plane_rows > 0 || irradiance.size() == band_count() *
                                                              static_cast<std::size_t>(request.rows) *
                                                              static_cast<std::size_t>(request.window.width));
    assert(request.rows >= 0 && request.row_times.size() == static_cast<std::size_t>(request.rows));
    assert(request.levels.empty() || request.levels.size() == request.row_times.size());
    assert(!request.line || !request.pixel_times);
    assert(!request.line || (request.gate == nullptr && request.samples.empty() && request.variance.empty()));
    // The wings of each line are maps of their own: no more at a time than rows share.
    if (request.line && request.rows > 1 && built.wing_kernels)
        return impl_->render_line_by_line(*this, request, irradiance, cancel);
    RowBlock& rows = impl_->block_of(request);
    // Gates and kept light take rows as they come.
    rows.cancel = request.gate == nullptr && request.keep == nullptr ? cancel : nullptr;
    const PassRequest pass = impl_->pass_of(request);
    if (pass.keep_light != nullptr) impl_->begin_keeping(pass);
    if (pass.pixel_times) fill_spans(pass, rows);
    built.splatter.star_rows().assign(pass.pixel_times ? rows.spans : pass.row_times, request.window,
                                      pass.sensor_y(0), request.line.has_value(), rows.stars);
    if (!fill_sample_grid(workers, pass, cancel, rows) ||
        !fill_sparse_grid(workers, pass, QualityLevel::grid, cancel, rows) ||
        !fill_sparse_grid(workers, pass, QualityLevel::quarter, cancel, rows) ||
        !fill_sparse_grid(workers, pass, QualityLevel::sixteenth, cancel, rows) ||
        !fill_motion(workers, pass, cancel, rows) || !fill_points(workers, pass, cancel, rows) ||
        !fill_wings(workers, pass, cancel, rows))
        return false;
    const auto render_row = [&](std::int32_t r, Scratch& s) {
        const RenderedRow how = pass.pixel_times ? render_scanned_row(built, pass, rows, r, irradiance, s)
                                                 : renderer::render_row(built, pass, rows, r, irradiance, s);
        if (request.gate != nullptr) request.gate->done(r, how);
    };
    if (request.gate == nullptr)
        return workers.for_rows(RenderPart::rest, request.rows, pass.of, cancel, render_row);
    return workers.for_rows(
        RenderPart::rest, request.rows, pass.of, cancel,
        [&](std::int32_t r) {
            return request.gate->wants(r) &&
                   grids_ready(built, pass, rows, r, workers.own_scratch(pass.of.alone));
        },
        render_row);
}

bool Renderer::has_level(QualityLevel level) const noexcept {
    switch (level) {
    case QualityLevel::goal:
        return impl_->built.settings.target_error > 0 || impl_->built.settings.samples_per_pixel > 1;
    case QualityLevel::instants:
        return impl_->built.settings.max_instants > 1;
    case QualityLevel::bounces:
        return impl_->built.lighting.max_bounces > 1;
    default:
        return level <= QualityLevel::sixteenth;
    }
}

std::uint32_t Renderer::bounces_at(QualityLevel level) const noexcept {
    return (level == QualityLevel::bounces ? impl_->built.lighting_few_bounces : impl_->built.lighting)
        .max_bounces;
}

bool Renderer::render_aovs(const RenderRequest& request, std::span<float> aovs,
                           const std::atomic<bool>* cancel) const {
    const auto width = static_cast<std::size_t>(request.window.width);
    const std::size_t plane = static_cast<std::size_t>(request.rows) * width;
    assert(aovs.size() == aov_count * plane);
    return impl_->workers.for_rows(
        RenderPart::rest, request.rows, impl_->rows_of(request), cancel, [&](std::int32_t r, Scratch& s) {
            if (request.pixel_times) return trace_scanned_aovs(impl_->built, request, r, aovs, s);
            const double time_s = to_seconds(request.row_times[static_cast<std::size_t>(r)].mid().ns);
            const RowState& row = begin_row(impl_->built, time_s, s);
            trace_aovs(*s.lens, row, request.window.x, request.window.y + request.first_row + r,
                       request.window.width, impl_->built.pixel_width_rad(), s.candidates,
                       aovs.data() + static_cast<std::size_t>(r) * width, plane);
        });
}

bool Renderer::intersect(Time t, std::span<const Ray> rays, std::span<double> distances_m,
                         const std::atomic<bool>* cancel) const {
    assert(distances_m.size() == rays.size());
    constexpr std::size_t at_once = 4096;
    const std::size_t blocks = (rays.size() + at_once - 1) / at_once;
    return impl_->workers.for_rows(
        RenderPart::rest, static_cast<std::int32_t>(blocks), {}, cancel, [&](std::int32_t block, Scratch& s) {
            const std::size_t first = static_cast<std::size_t>(block) * at_once;
            const std::size_t count = std::min(at_once, rays.size() - first);
            std::vector<Vec3> origins, directions;
            for (const Ray& ray : rays.subspan(first, count)) {
                origins.push_back(ray.origin_m);
                directions.push_back(normalized(ray.direction));
            }
            nearest_distances(begin_row(impl_->built, to_seconds(t.ns), s), origins, directions,
                              distances_m.subspan(first, count));
        });
}

View Renderer::view(Time t) const {
    Scratch s;
    for (const SurfaceTiles* const tiles : impl_->built.terrains)
        s.pins.push_back(tiles->pin());
    const RowState& row = begin_row(impl_->built, to_seconds(t.ns), s);
    const RowTime time{t, t};
    StarsInView stars;
    impl_->built.splatter.star_rows().find({&time, 1}, stars);
    return view_of(impl_->built.scene, row, *s.lens, stars.stars, stars.observer);
}

double Renderer::image_motion_px(const RowTime& span) const noexcept {
    return renderer::motion_px(impl_->built.scene, impl_->built.bodies, *impl_->built.lens,
                               impl_->built.splatter.reach_px(), span);
}

double Renderer::image_change_px(const GroundTruth& from, const GroundTruth& to) const noexcept {
    return change_px(impl_->built.scene, impl_->built.bodies, *impl_->built.lens,
                     impl_->built.splatter.reach_px(), from, to);
}

double Renderer::lamp_change_px(const GroundTruth& from, std::span<const Pose> from_lamps,
                                const GroundTruth& to, std::span<const Pose> to_lamps) const noexcept {
    return renderer::lamp_change_px(impl_->built.scene, impl_->built.bodies, *impl_->built.lens, from,
                                    from_lamps, to, to_lamps);
}

void Renderer::fill_lamps(Time t, std::span<Pose> lamps) const noexcept {
    const std::vector<scene::Lamp>& all = impl_->built.scene.lamps;
    for (std::size_t i = 0; i < std::min(lamps.size(), all.size()); ++i)
        lamps[i] = lamp_pose(impl_->built.scene, impl_->built.bodies, all[i], to_seconds(t.ns));
}

void Renderer::fill_truth(Time t, GroundTruth& truth) const noexcept {
    fill_ground_truth(impl_->built, t, truth);
}

void Renderer::list_truth(const TruthRequest& request, SceneTruth& truth) const {
    list_frame_truth(impl_->built, impl_->tiles, request, impl_->block_scratch.local().stars,
                     impl_->workers.own_scratch(), truth);
}

Overlay Renderer::overlay(const OverlayRequest& request) const {
    const std::lock_guard one_at_a_time(impl_->overlay_mutex);
    if (!impl_->overlay_memory) impl_->overlay_memory = std::make_unique<TruthMemory>();
    return frame_overlay(impl_->built, impl_->tiles, request, *impl_->overlay_memory);
}

std::uint64_t Renderer::rays_traced() const noexcept {
    return impl_->workers.work().rays;
}

std::uint64_t Renderer::samples_taken() const noexcept {
    return impl_->workers.work().samples;
}

RenderWork Renderer::work() const noexcept {
    RenderWork work = impl_->workers.work();
    for (const BuiltBody& body : impl_->built.bodies)
        if (body.textures) work.tiles_missed += body.textures->missed_tiles();
    return work;
}

} // namespace obscura::renderer
