// SPDX-License-Identifier: Apache-2.0
// Material presets of planets and large moons: geometric albedo, colour and phase curve of the whole disc.
#pragma once

#include "core/spectral_band.hpp"
#include "renderer/scene/scene.hpp"

#include <vector>

namespace obscura::renderer {

// One function for each preset. Its comment in planet_presets.cpp gives the sources, and the range of phase
// angles that they cover.
[[nodiscard]] scene::Material mercury();
[[nodiscard]] scene::Material venus();
[[nodiscard]] scene::Material earth();
[[nodiscard]] scene::Material mars();
[[nodiscard]] scene::Material jupiter();
[[nodiscard]] scene::Material saturn();
[[nodiscard]] scene::Material io();
[[nodiscard]] scene::Material europa();
[[nodiscard]] scene::Material ganymede();
[[nodiscard]] scene::Material callisto();

// Reflectance over wavelength, relative to that at 550 nm.
[[nodiscard]] std::vector<SpectralPoint> mercury_curve();
[[nodiscard]] std::vector<SpectralPoint> venus_curve();
[[nodiscard]] std::vector<SpectralPoint> earth_curve();
[[nodiscard]] std::vector<SpectralPoint> mars_curve();
[[nodiscard]] std::vector<SpectralPoint> jupiter_curve();
[[nodiscard]] std::vector<SpectralPoint> saturn_curve();
[[nodiscard]] std::vector<SpectralPoint> io_curve();
[[nodiscard]] std::vector<SpectralPoint> europa_curve();
[[nodiscard]] std::vector<SpectralPoint> ganymede_curve();
[[nodiscard]] std::vector<SpectralPoint> callisto_curve();

} // namespace obscura::renderer
