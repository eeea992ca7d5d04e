// SPDX-License-Identifier: Apache-2.0
// Light as a detector converts it: bands weighted by a quantum efficiency, for each source by its spectrum.
#pragma once

#include "core/spectral_band.hpp"
#include "renderer/scene/scene.hpp"

#include <cstddef>
#include <span>

namespace obscura::renderer {

/// Sets SpectralBand::response of all bands of `scene` by a detector's quantum efficiency (linear between its
/// points, constant beyond): transmission times efficiency times wavelength, scaled so that sunlight keeps
/// its irradiance. An image is then the sunlight, W/m2, of as many electrons as each source gives, whatever
/// its spectrum, and electrons_per_joule() of the band converts all of it. Bodies with a curve of their
/// colour, stars, and lamps and bodies that glow with a spectrum are weighted by it; light without a spectrum
/// counts as sunlight.
void set_detector_response(scene::Scene& scene, std::span<const SpectralPoint> quantum_efficiency);

/// Light of a body in W/m2 over its light as the response weighs it; 1 without a response.
[[nodiscard]] inline double energy_of_response(const scene::Body& body, std::size_t band) {
    return band < body.colour_of_energy.size() && body.colour[band] > 0
               ? body.colour_of_energy[band] / body.colour[band]
               : 1;
}

} // namespace obscura::renderer
