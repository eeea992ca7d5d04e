// SPDX-License-Identifier: Apache-2.0
// Read this first: the renderer turns a scene and row times into irradiance per pixel, W/m2 per band.
//
// Frames and units. Inertial frame: right-handed, metres, J2000 axes where stars matter. Camera frame: x
// right, y down, z boresight. A quaternion is scalar first and turns vectors of the thing's own frame into
// the inertial frame. Output: irradiance at the entrance pupil from the solid angle of each pixel, W/m2 per
// spectral band; where nothing is, exactly 0. The sum over a star's pixels is the star's irradiance.
#pragma once

#include "core/frame.hpp"
#include "core/geometry.hpp"
#include "core/region.hpp"
#include "core/time.hpp"
#include "renderer/integrators/aovs.hpp"
#include "renderer/scene/scene.hpp"

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace obscura::renderer {

/// Quality, threads and seed of a renderer; fixed for its life.
struct RenderSettings {
    std::uint32_t samples_per_pixel = 4; ///< rays per pixel that a body may cover
    std::uint32_t threads = 0;           ///< 0: one per core
    std::uint64_t seed = 1;
    /// Adaptive sampling: pixels that need it get more samples, until the standard error, root mean square
    /// over the lit pixels, is at most about this share of the lit body's brightness or of the pixel's own,
    /// whichever is larger. With `samples_per_pixel` 1 or 2, a PSF of 0.4 to 0.75 px and rows that see one
    /// instant, pixels begin with one ray each, which neighbours share through the PSF
    /// (renderer/integrators/sample_grid.hpp); else with that many of their own (2 at least; 4 for errors
    /// below 0.02). 0: `samples_per_pixel` everywhere.
    double target_error = 0;
    std::uint32_t max_samples_per_pixel = 64; ///< with target_error
    /// Reflections after the first, at least the scene's own number: 0 is direct light only. Needed for light
    /// between bodies and for mirrors.
    std::uint32_t max_bounces = 0;
    /// Where something moves in the picture during a row's exposure, its light is that of several instants,
    /// half a pixel of motion apart, and of so many at most; a pixel's samples are shared out to them, so
    /// that they cost no more. 1: all is seen at mid-exposure.
    std::uint32_t max_instants = 256;
};

/// One piece of work: some rows of a window, each to be seen at its own time. The result depends on nothing
/// but the scene, the settings and these fields: not on how rows are grouped into row blocks, nor on the
/// number of threads.
struct RenderRequest {
    Region window;              ///< in sensor pixels; the image is `window.width` wide
    std::int32_t first_row = 0; ///< rows [first_row, first_row + rows) of the window
    std::int32_t rows = 0;
    std::span<const RowTime> row_times; ///< one per requested row; see RenderSettings::max_instants
    std::uint64_t frame_id = 0;         ///< decorrelates the sampling of successive frames
    /// Where they are wanted, rows x window.width each: how many samples each pixel got, and the estimated
    /// variance of the mean of its bands, in the square of the image's unit. Bodies smaller than pixels and
    /// stars are not in them.
    std::span<float> samples{}, variance{};
};

/// The renderer of one camera in one scene. Thread-safe after construction as long as each render() has its
/// own output; render() spreads over the renderer's own worker threads and returns when all rows are done.
class Renderer {
public:
    /// Loads meshes and catalogues and builds the acceleration structures. Throws InputError or ConfigError.
    Renderer(scene::Scene scene, RenderSettings settings);
    ~Renderer();
    Renderer(Renderer&&) noexcept;
    Renderer& operator=(Renderer&&) noexcept;

    [[nodiscard]] const scene::Scene& scene() const noexcept;
    [[nodiscard]] std::size_t band_count() const noexcept;

    /// Fills `irradiance` (bands x rows x window.width floats). Returns false when `cancel` became true on
    /// the way.
    bool render(const RenderRequest& request, std::span<float> irradiance,
                const std::atomic<bool>* cancel = nullptr) const;

    /// Fills `aovs` (aov_count x rows x window.width floats, in the order of Aov) with the geometry at the
    /// rows' times; where nothing is, `body` is 0 and all else NaN. Returns as render() does.
    bool render_aovs(const RenderRequest& request, std::span<float> aovs,
                     const std::atomic<bool>* cancel = nullptr) const;

    /// Poses of everything at `t`, for the frame's ground truth.
    void fill_truth(Time t, GroundTruth& truth) const noexcept;

    /// Rays traced so far (primary + shadow), for benchmarks.
    [[nodiscard]] std::uint64_t rays_traced() const noexcept;
    [[nodiscard]] std::uint64_t samples_taken() const noexcept;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace obscura::renderer
