// SPDX-License-Identifier: Apache-2.0
// Built scene: all that a renderer makes of a scene file and its settings before the first row.
#pragma once

#include "renderer/camera/gaussian_psf.hpp"
#include "renderer/camera/projection.hpp"
#include "renderer/camera/psf.hpp"
#include "renderer/camera/stray_light.hpp"
#include "renderer/camera/wing_kernels.hpp"
#include "renderer/integrators/block_tracer.hpp"
#include "renderer/integrators/point_splatter.hpp"
#include "renderer/lights/lighting.hpp"
#include "renderer/lights/star_spectra.hpp"
#include "renderer/planets/surface_tiles.hpp"
#include "renderer/renderer.hpp"
#include "renderer/world/build.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace obscura::renderer {

/// The scene of a renderer as it is traced. Thread-safe after construction; refers to itself, so that it
/// stays where it is.
struct BuiltScene {
    /// Throws InputError or ConfigError. set_lighting() must follow.
    BuiltScene(scene::Scene s, RenderSettings r);
    BuiltScene(const BuiltScene&) = delete;
    BuiltScene& operator=(const BuiltScene&) = delete;
    /// Second step of the construction: what depends on the light, once loaders have made the tiles that
    /// terrains always have. Throws as the constructor.
    void set_lighting();

    scene::Scene scene;
    RenderSettings settings; ///< with the number of threads, and at least one of what must be
    std::unique_ptr<const Projection> lens;
    std::unique_ptr<const Psf> psf;      ///< null: the Gaussian
    GaussianPsf gaussian_psf;            ///< after `psf`, which may set its sigma
    std::optional<GaussianPsf> grid_psf; ///< of points of the sample grid that are means already
    std::vector<BuiltBody> bodies;
    std::vector<const SurfaceTiles*> terrains; ///< tiles of the bodies, each once
    std::vector<Vec3> landmarks_m;             ///< see landmark_points()
    PointSplatter splatter;
    std::vector<StrayMap> stray;
    double field_rad;                     ///< largest angle of a pixel's centre to the boresight
    std::vector<double> sun_w_m2;         ///< per band, at 1 au
    std::vector<StarBins> star_energy_um; ///< see TruthScene
    Lighting lighting;
    Lighting lighting_few_bounces; ///< of QualityLevel::bounces
    bool plain = true;             ///< direct sunlight on grey surfaces: one channel is enough
    std::unique_ptr<const WingKernels> wing_kernels; ///< null: the PSF has no wings

    /// Channels of the light that is traced.
    [[nodiscard]] std::size_t channels() const { return plain ? 1 : scene.bands.size(); }
    /// How pixels of a frame are sampled at a level.
    [[nodiscard]] Sampling sampling(std::uint64_t frame_id, QualityLevel level = QualityLevel::full) const;
    /// Irradiance of the Sun at the camera over that at 1 au.
    [[nodiscard]] double sun_at_camera(const RowState& row) const;
    /// Largest displacement of a camera sample by the PSF, along an axis.
    [[nodiscard]] double sample_reach_px() const { return psf ? psf->reach_px() : gaussian_psf.reach_px(); }
    /// Standard deviation of a pixel's response along an axis, PSF and pixel.
    [[nodiscard]] double response_px() const;
    /// Largest angle across a square of a pixel's area, for the footprints of rays.
    [[nodiscard]] double pixel_width_rad() const;

private:
    void set_grid_psf();
};

} // namespace obscura::renderer
