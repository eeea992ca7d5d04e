// SPDX-License-Identifier: Apache-2.0
// Single-scattering albedo over wavelength: parameters and colour of a body whose w follows a spectrum.
#pragma once

#include "core/spectral_band.hpp"
#include "renderer/scene/scene.hpp"

#include <span>
#include <vector>

namespace obscura::renderer {

/// Makes the single-scattering albedo of the material of `body`, Hapke's, follow `factors`, its factor over
/// wavelength. The material gets the mean over `bands` of the means over sunlight in each, so that a scene of
/// one band has exactly the law of its w. Returns the reflectance over wavelength relative to that
/// material's, lit and seen at 45 degrees and 90 degrees of phase: what scatters more than once grows faster
/// than w, at small phase angles less so (a factor of 1.08 on w = 0.33 is one of 1.10, and 1.09 at 30
/// degrees). A w that an image gives stays, and is that of factor 1.
[[nodiscard]] std::vector<SpectralPoint> follow_albedo_curve(scene::Body& body,
                                                             const std::vector<SpectralPoint>& factors,
                                                             std::span<const SpectralBand> bands);

} // namespace obscura::renderer
