// SPDX-License-Identifier: Apache-2.0
// Renderer: turns a scene and row times into irradiance per pixel, W/m2 per band. Read this header first.
//
// Frames and units. Inertial frame: right-handed, metres, J2000 axes where stars matter. Camera frame: x
// right, y down, z boresight. A quaternion is scalar first and turns vectors of the moving frame into the
// inertial frame. Output: irradiance at the entrance pupil from the solid angle of each pixel, W/m2 per
// spectral band; where nothing is, exactly 0. The sum over a star's pixels is the star's irradiance.
#pragma once

#include "core/camera/frame.hpp"
#include "core/camera/frame_quality.hpp"
#include "core/camera/region.hpp"
#include "core/geometry.hpp"
#include "core/time.hpp"
#include "renderer/integrators/aovs.hpp"
#include "renderer/pixel_times.hpp"
#include "renderer/render_work.hpp"
#include "renderer/reprojection/kept_window.hpp"
#include "renderer/scene/scene.hpp"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace obscura {
struct SceneTruth;
}

namespace obscura::renderer {

struct Overlay;
struct OverlayRequest;
struct View;
struct TruthRequest;
class Renderer;
class ShapeCache;

/// An empty cache for RenderSettings::shapes.
[[nodiscard]] std::shared_ptr<ShapeCache> make_shape_cache();

/// Quality, threads and seed of a renderer; fixed after construction.
struct RenderSettings {
    std::uint32_t samples_per_pixel = 4; ///< rays per pixel near a body
    std::uint32_t threads = 0;           ///< 0: one per core
    std::uint64_t seed = 1;
    /// Target error of adaptive sampling: pixels get more samples until the standard error, root mean square
    /// over the lit pixels, is at most about this fraction of the lit body's radiance or of the pixel's own,
    /// whichever is larger; light of many reflections or of area lights comes within a factor of 1.3. With
    /// `samples_per_pixel` 1 or 2, a PSF of 0.4 to 0.75 px and rows of one instant, pixels begin with one ray
    /// each on a shared sample grid (renderer/integrators/sample_grid.hpp) if RenderRequest::common_mid is
    /// theirs; else with as many samples of their own (at least 2; 4 for errors below 0.02). 0:
    /// `samples_per_pixel` everywhere.
    double target_error = 0;
    std::uint32_t max_samples_per_pixel = 64; ///< with target_error
    /// Largest number of reflections after the first, at least the scene's own; 0: direct light only. Light
    /// between bodies and mirrors need more.
    std::uint32_t max_bounces = 0;
    /// Motion blur: largest number of instants, half a pixel of motion apart, at which the scene is set up
    /// for a row. Each sample of a pixel takes one of them, stratified over the exposure and scrambled pixel
    /// by pixel, so that pixels need no more samples. 1: mid-exposure only.
    std::uint32_t max_instants = 256;
    /// Called on a worker thread whenever it begins to help with this renderer's rows: sets its scheduling.
    /// Must not throw; cheap when repeated. Not called on the threads that call render().
    std::function<void()> enter_worker{};
    /// Whether rows wait for the tiles of terrains that they need. False, for real time: coarser tiles serve
    /// for those that are missing (RenderWork::surface_coarser), while threads of ordinary priority make them
    /// from what rays missed and where the camera will be. Then the result depends on what is there.
    bool wait_for_tiles = true;
    double tiles_per_s = 0; ///< without waiting: at most so many are made a second; 0: as many as can be
    /// Called first on each of those threads: sets its scheduling. Must not throw.
    std::function<void()> enter_loader{};
    /// Share of a core that each of those threads takes at most while rows are rendered.
    double loader_share = 1;
    /// Cache of shapes from one renderer to the next: equal shapes are reused, so that a scene whose poses or
    /// materials change is built quickly, with the same pictures. Null: none. Not for renderers that are made
    /// at the same time.
    std::shared_ptr<ShapeCache> shapes{};
    /// Called before each row, on every thread that renders rows; `first`: of those that the thread was just
    /// given. It may sleep. Not called for requests with memory of their own (RenderRequest::alone). Must not
    /// throw.
    std::function<void(bool first)> before_row{};
};

/// How a row was rendered.
struct RenderedRow {
    std::uint32_t instants = 1; ///< of its exposure at which pixels were sampled
    /// As requested, or full where no body is near: then the level makes no difference.
    QualityLevel level = QualityLevel::full;
};

/// Follows the rows of a request that has a deadline. All calls come from render threads and must be
/// real-time safe.
class RowGate {
public:
    virtual ~RowGate() = default;
    /// Whether row `r` of the request is still wanted; asked in the order of the rows before each unit of
    /// their work. A row that is not wanted is left as it was.
    virtual bool wants(std::int32_t r) noexcept = 0;
    /// Row `r` has been written.
    virtual void done(std::int32_t r, const RenderedRow& how) noexcept = 0;
};

/// Samples that the requests of one frame share, so that rendering it in parts costs no more than in one
/// request. Requests that use it come one after the other.
class FrameSamples {
public:
    FrameSamples();
    ~FrameSamples();
    FrameSamples(const FrameSamples&) = delete;
    FrameSamples& operator=(const FrameSamples&) = delete;
    /// Drops all samples before another frame, or another state of the scene.
    void begin_frame() noexcept;

private:
    friend class Renderer;
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Light of the bodies in a frame, from which rows of another frame of the same windows can be made, each
/// window from itself: reprojected, rotation exactly, translation by range, bodies each with its own motion
/// (renderer/reprojection/). Holds neither stars nor sub-pixel bodies, which are drawn at their own times.
/// Thread-bound but for what render() does with it; real-time safe after construction for areas of that size
/// and scenes with as many bodies.
class ReprojectionSource {
public:
    /// For at most so many windows of such a renderer, `width` pixels wide and of `rows` rows in all.
    ReprojectionSource(const Renderer& renderer, std::int32_t width, std::int32_t rows,
                       std::size_t windows = 1);
    ~ReprojectionSource();
    ReprojectionSource(const ReprojectionSource&) = delete;
    ReprojectionSource& operator=(const ReprojectionSource&) = delete;
    /// Forgets the light: rows of these windows are kept from now on (RenderRequest::keep). False if they
    /// need more room, or one has too few lines of a push-broom sensor.
    bool begin_frame(std::span<const KeptWindow> windows) noexcept;
    bool begin_frame(const KeptWindow& window) noexcept { return begin_frame({&window, 1}); }
    /// Forgets where things are in the frame that is made of it (RenderRequest::from): another one follows.
    void begin_reprojection() noexcept;
    /// Whether all rows of the windows have been kept by `renderer`.
    [[nodiscard]] bool complete(const Renderer& renderer) const noexcept;
    /// Windows of the frame begun last; none if there was no room.
    [[nodiscard]] std::span<const KeptWindow> windows() const noexcept;

private:
    friend class Renderer;
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Memory of a thread that renders requests alone (RenderRequest::alone). Thread-bound; requests of such a
/// frame allocate nothing from the first one on, unless the scene shows more stars, or more bodies below a
/// pixel, than at its start.
class Workspace {
public:
    /// For areas of at most `width` x `rows` pixels of such a renderer. Renders rows of one.
    Workspace(const Renderer& renderer, std::int32_t width, std::int32_t rows);
    ~Workspace();
    Workspace(const Workspace&) = delete;
    Workspace& operator=(const Workspace&) = delete;

private:
    friend class Renderer;
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// A ray in the inertial frame.
struct Ray {
    Vec3 origin_m;
    Vec3 direction; ///< any length above 0
};

/// Request for some rows of a window, each at its own time. The result depends only on the scene, the
/// settings, these fields and the light in `from`: neither on how rows are grouped into row blocks nor on the
/// number of threads, `kept` or `gate`.
struct RenderRequest {
    Region window;              ///< in sensor pixels; the image is `window.width` wide
    std::int32_t first_row = 0; ///< rows [first_row, first_row + rows) of the window
    std::int32_t rows = 0;
    std::span<const RowTime> row_times; ///< one per requested row; see RenderSettings::max_instants
    /// Where pixels have times of their own, which count then: not with `line`; levels, `keep` and `from` do
    /// nothing. Pixels among which nothing moves much share a time (renderer/passes/scan_pass.hpp), and the
    /// wings of the PSF in a row are those at the time of the row.
    PixelTimes pixel_times{};
    std::uint64_t frame_id = 0; ///< decorrelates the sampling of successive frames
    /// See common_mid(): of all rows of the frame, requested or not. Rows with this middle can share samples
    /// (RenderSettings::target_error), all others take their own.
    std::optional<Time> common_mid{};
    /// Optional outputs, rows x window.width each: number of samples of each pixel, and the estimated
    /// variance of the mean of its bands, in the square of the image's unit: 0 only where no ray was traced
    /// (renderer/integrators/noise_estimate.hpp). Sub-pixel bodies and stars are not included.
    std::span<float> samples{}, variance{};
    /// Level of each requested row, of those that render; empty: full. Where a level differs in nothing from
    /// a better one in this scene, it gives that one's result.
    std::span<const QualityLevel> levels{};
    /// With levels: times of all rows of the frame's window, requested or not, from row `frame_y` of the
    /// sensor. Sparse grids reach beyond the requested rows.
    std::span<const RowTime> frame_times{};
    std::int32_t frame_y = 0;
    /// Rows of a plane of the irradiance, at least `rows`; 0: `rows`.
    std::int32_t plane_rows = 0;
    FrameSamples* kept = nullptr;
    RowGate* gate = nullptr;
    ReprojectionSource* keep = nullptr; ///< keeps the light of the rows; its area is as wide as the window
    /// For rows at QualityLevel::reprojected and repeated: a frame of the same columns, complete().
    ReprojectionSource* from = nullptr;
    std::size_t kept_window = 0; ///< of those
    /// Push-broom: all rows are the first row of the window, which is one row high, and are the lines from
    /// this one on of those in `frame_times`.
    std::optional<std::int32_t> line{};
    /// The calling thread renders the rows alone, in this memory, whatever the workers do; null: they do.
    Workspace* alone = nullptr;
};

/// Middle of the exposure if it is the same for all rows of a frame, as with a global shutter.
[[nodiscard]] inline std::optional<Time> common_mid(std::span<const RowTime> frame) {
    if (frame.empty()) return std::nullopt;
    const Time mid = frame.front().mid();
    const bool common =
        std::all_of(frame.begin(), frame.end(), [&](const RowTime& row) { return row.mid() == mid; });
    return common ? std::optional(mid) : std::nullopt;
}

/// Renderer of one camera in one scene. Thread-safe after construction if each render() has its own output;
/// render() spreads over the renderer's own worker threads and returns when all rows are done.
class Renderer {
public:
    /// Loads meshes and catalogues and builds the acceleration structures. Throws InputError or ConfigError.
    Renderer(scene::Scene scene, RenderSettings settings);
    ~Renderer();
    Renderer(Renderer&&) noexcept;
    Renderer& operator=(Renderer&&) noexcept;

    [[nodiscard]] const scene::Scene& scene() const noexcept;
    [[nodiscard]] std::size_t band_count() const noexcept;
    /// Whether rows of that level can differ from those of the next better one.
    [[nodiscard]] bool has_level(QualityLevel level) const noexcept;
    /// Reflections after the first, and instants of a row, at a level.
    [[nodiscard]] std::uint32_t bounces_at(QualityLevel level) const noexcept;

    /// Fills `irradiance` (bands x rows x window.width floats). Returns false if `cancel` became true, or
    /// the gate left out rows, meanwhile.
    bool render(const RenderRequest& request, std::span<float> irradiance,
                const std::atomic<bool>* cancel = nullptr) const;

    /// Finds how far the bodies that the request's rows see have moved since the light in `from` was kept, at
    /// most, px: of each row; infinite if no line of a push-broom sensor has what the row sees. Rows that are
    /// reprojected then take no longer than without. Returns as render().
    bool kept_motion_px(const RenderRequest& request, std::span<float> px,
                        const std::atomic<bool>* cancel = nullptr) const;

    /// Makes the tiles of terrains that the request's rows need, and the visibility of the Sun in them, on
    /// threads of its own: as many as render, of the caller's scheduling class. Calls `go_on` first, then
    /// several times a second, with the share of the rows that is done; it ends this by returning false.
    /// Returns whether all is done. Throws what the sources of tiles throw.
    bool load_tiles(const RenderRequest& request, const std::function<bool(double share)>& go_on) const;
    /// Tiles of terrains made so far, and visibilities of the Sun in them, those replaced since included.
    [[nodiscard]] std::uint64_t tiles_made() const noexcept;
    /// Per terrain: name, tiles built, tile capacity.
    struct TerrainTiles {
        std::string body;
        std::uint64_t made = 0, slots = 0;
    };
    [[nodiscard]] std::vector<TerrainTiles> terrain_tiles() const;

    /// Fills `aovs` (aov_count x rows x window.width floats, in the order of Aov) with the geometry at the
    /// rows' times; where no body is, `body` is 0 and all else NaN. Returns as render().
    bool render_aovs(const RenderRequest& request, std::span<float> aovs,
                     const std::atomic<bool>* cancel = nullptr) const;

    /// Distances along rays, m, to the nearest surface of bodies and the Sun where the camera sees them at
    /// `t`; infinite: none. Returns as render().
    bool intersect(Time t, std::span<const Ray> rays, std::span<double> distances_m,
                   const std::atomic<bool>* cancel = nullptr) const;

    /// Field of view, bodies and stars at `t` (renderer/world/view.hpp). Allocates.
    [[nodiscard]] View view(Time t) const;

    /// Largest apparent motion of anything in the field between the two instants of `span`, pixels.
    /// Thread-safe, real-time safe.
    [[nodiscard]] double image_motion_px(const RowTime& span) const noexcept;

    /// The same from one state of the scene to another, as fill_truth() gives them; infinite if they have no
    /// room for all bodies.
    [[nodiscard]] double image_change_px(const GroundTruth& from, const GroundTruth& to) const noexcept;

    /// The same of the light of lamps (renderer/world/lamp_change.hpp), whose poses fill_lamps() gives.
    [[nodiscard]] double lamp_change_px(const GroundTruth& from, std::span<const Pose> from_lamps,
                                        const GroundTruth& to, std::span<const Pose> to_lamps) const noexcept;
    /// Poses of the scene's lamps at `t`, as many as `lamps` has room for.
    void fill_lamps(Time t, std::span<Pose> lamps) const noexcept;

    /// Poses of everything at `t`, for the frame's ground truth.
    void fill_truth(Time t, GroundTruth& truth) const noexcept;

    /// Lists where stars and bodies are in the pixels of a frame (renderer/truth/scene_truth.hpp).
    void list_truth(const TruthRequest& request, SceneTruth& truth) const;

    /// Where bodies, limbs and stars are in the image of a frame (renderer/truth/overlay.hpp). One call after
    /// the other; allocates.
    [[nodiscard]] Overlay overlay(const OverlayRequest& request) const;

    /// Rays traced so far (primary + shadow), for benchmarks.
    [[nodiscard]] std::uint64_t rays_traced() const noexcept;
    [[nodiscard]] std::uint64_t samples_taken() const noexcept;
    /// Where the time of render() has gone so far. Thread-safe, real-time safe.
    [[nodiscard]] RenderWork work() const noexcept;

private:
    friend class ReprojectionSource;
    friend class Workspace;
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace obscura::renderer
