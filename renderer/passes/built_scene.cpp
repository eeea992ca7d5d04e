// SPDX-License-Identifier: Apache-2.0
#include "renderer/passes/built_scene.hpp"

#include "core/solar_spectrum.hpp"
#include "renderer/integrators/sample_grid.hpp"
#include "renderer/lights/spectrum.hpp"
#include "renderer/planets/sun_visibility.hpp"
#include "renderer/scene/position.hpp"
#include "renderer/truth/landmarks.hpp"

#include <algorithm>
#include <cmath>
#include <thread>
#include <utility>

namespace obscura::renderer {
namespace {

/// QualityLevel::goal: of the target error, or of the samples per pixel without one.
constexpr double larger_error = 2.5;
constexpr std::uint32_t fewer_samples = 4;

/// Settings with what 0 stands for, and at least one of what must be.
RenderSettings completed(RenderSettings settings, const scene::Scene& scene) {
    if (settings.threads == 0) settings.threads = std::max(1u, std::thread::hardware_concurrency());
    settings.samples_per_pixel = std::max(1u, settings.samples_per_pixel);
    settings.max_instants = std::max(1u, settings.max_instants);
    settings.max_bounces = std::max(settings.max_bounces, scene.max_bounces);
    return settings;
}

} // namespace

BuiltScene::BuiltScene(scene::Scene s, RenderSettings r)
    : scene((validate(s), std::move(s))),
      settings(completed(std::move(r), scene)),
      lens(scene::at_position(scene.camera.position, [&] { return make_projection(scene.camera); })),
      psf(scene::at_position(scene.camera.position, [&] { return Psf::make(scene.camera, scene.bands); })),
      gaussian_psf(scene.camera.psf_sigma_px, scene.camera.pixel_aspect()),
      bodies(build_bodies(scene, settings.shapes.get())),
      landmarks_m(landmark_points(scene, bodies)),
      splatter(scene, bodies, *lens, gaussian_psf, psf.get(), settings.seed),
      stray(read_stray_light(scene)),
      field_rad(lens->field_angle_rad(1)) {
    for (const BuiltBody& body : bodies)
        if (const SurfaceTiles* tiles = body.shape->tiles();
            tiles != nullptr && std::find(terrains.begin(), terrains.end(), tiles) == terrains.end())
            terrains.push_back(tiles);
    if (std::any_of(scene.bands.begin(), scene.bands.end(),
                    [](const SpectralBand& band) { return !band.response.empty(); }))
        for (SpectralBand band : scene.bands) {
            band.response.clear();
            star_energy_um.push_back(star_band_weights_um(band));
        }
}

void BuiltScene::set_lighting() {
    // Before textures are read for the light of bodies.
    if (!settings.wait_for_tiles)
        for (const BuiltBody& body : bodies)
            if (body.textures) body.textures->stop_waiting();
    if (settings.max_bounces > 0) guide_bounces(bodies);
    for (const SpectralBand& band : scene.bands)
        sun_w_m2.push_back(sun_irradiance_w_m2(band) * scene.sun.irradiance_scale);
    lighting = make_lighting(scene, area_lights_of(bodies), sun_w_m2, settings.max_bounces);
    lighting_few_bounces = lighting;
    lighting_few_bounces.max_bounces = std::min(lighting.max_bounces, 1U);
    plain = settings.max_bounces == 0 && scene.lamps.empty() && !(psf && psf->chromatic()) &&
            std::all_of(bodies.begin(), bodies.end(), [](const BuiltBody& b) {
                return b.colour.empty() && b.emission.empty() && (!b.textures || b.textures->grey()) &&
                       (!b.material || !b.material->spectral());
            });
    set_grid_psf();
    if (psf && psf->wings_px() > 0) wing_kernels = std::make_unique<WingKernels>(*psf, channels());
}

/// The light of terrains that keep the Sun's visibility is a mean about each ray: what that widens the PSF by
/// is taken off the kernel of the sample grid.
void BuiltScene::set_grid_psf() {
    const bool means =
        plain && !terrains.empty() && std::all_of(bodies.begin(), bodies.end(), [](const BuiltBody& body) {
            return body.material == nullptr || // the Sun
                   (body.shape->tiles() != nullptr && body.shape->tiles()->sun_visibility() != nullptr);
        });
    const double mean_px = sun_mean_sigma / std::sqrt(settings.samples_per_pixel);
    const double sigma2 = scene.camera.psf_sigma_px * scene.camera.psf_sigma_px - mean_px * mean_px;
    if (!means || !(sigma2 > 0)) return;
    const GaussianPsf narrower(std::sqrt(sigma2), scene.camera.pixel_aspect());
    if (SampleGridKernel::fits(narrower)) grid_psf = narrower;
}

Sampling BuiltScene::sampling(std::uint64_t frame_id, QualityLevel level) const {
    Sampling how{settings.seed, frame_id, settings.max_samples_per_pixel, settings.target_error};
    if (level == QualityLevel::full) return how;
    how.target_error *= larger_error;
    if (settings.target_error == 0)
        how.sample_limit = std::max(1U, settings.samples_per_pixel / fewer_samples);
    if (level < QualityLevel::grid) return how;
    how.grid_only = true;
    return how;
}

double BuiltScene::sun_at_camera(const RowState& row) const {
    const double distance = length(row.sun_m - row.camera.position_m) / astronomical_unit_m;
    return scene.sun.irradiance_scale / (distance * distance);
}

double BuiltScene::response_px() const {
    return std::sqrt(gaussian_psf.x.sigma_px() * gaussian_psf.x.sigma_px() + 1.0 / 12);
}

double BuiltScene::pixel_width_rad() const {
    return lens->pixel_angle_rad() * std::sqrt(scene.camera.pixel_flattening());
}

} // namespace obscura::renderer
