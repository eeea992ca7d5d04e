// SPDX-License-Identifier: Apache-2.0
// Quantum efficiency of a spectral band: electrons per joule under the solar spectrum.
#pragma once

#include "core/spectral_band.hpp"
#include "sensors/description.hpp"

#include <span>

namespace obscura::sensors {

/// Quantum efficiency at a wavelength: linear between the points of the table, constant beyond its ends.
[[nodiscard]] double quantum_efficiency(std::span<const SpectralPoint> table, double wavelength_m);

/// Electrons per joule of light inside `band` on the detector: integral(S eta lambda / (h c)) / integral(S),
/// EMVA 1288 release 4 eq. 4 integrated over the band. S is the solar spectrum times the band's transmission,
/// because scenes consist of reflected sunlight; flat for bands outside the solar table.
[[nodiscard]] double electrons_per_joule(std::span<const SpectralPoint> table, SpectralBand band);

} // namespace obscura::sensors
