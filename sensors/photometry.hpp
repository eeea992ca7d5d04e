// From watts to electrons: the quantum efficiency folded with the spectrum of the light in a band.
#pragma once

#include "core/spectral_band.hpp"
#include "sensors/description.hpp"

#include <span>

namespace obscura::sensors {

/// Quantum efficiency at a wavelength: linear between the points of the table, the end values held beyond it.
[[nodiscard]] double quantum_efficiency(std::span<const SpectralPoint> table, double wavelength_m);

/// Electrons per joule that fell on the detector inside `band`:
/// integral(S eta lambda / (h c)) / integral(S), EMVA 1288 release 4 eq. 4 folded over the band, with S the
/// Sun's spectrum (flat where the Sun has none): reflected sunlight is what is in front of the camera.
[[nodiscard]] double electrons_per_joule(std::span<const SpectralPoint> table, SpectralBand band);

} // namespace obscura::sensors
