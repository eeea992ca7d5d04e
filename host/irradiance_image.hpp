// SPDX-License-Identifier: Apache-2.0
// EXR channels and FITS cards of an irradiance image with several spectral bands.
#pragma once

#include "core/spectral_band.hpp"
#include "images/writers/exr.hpp"

#include <span>
#include <string>
#include <vector>

namespace obscura::host {

/// "400-900nm".
[[nodiscard]] std::string band_name(const SpectralBand& band);

/// One channel per band, named like "irradiance.400-900nm". `image` holds the planes of the bands one after
/// the other and must outlive the channels.
[[nodiscard]] std::vector<images::ExrChannel> irradiance_channels(std::span<const float> image,
                                                                  const std::vector<SpectralBand>& bands);

/// Limits of the bands as header cards B0_FROM, B0_TO, ...
[[nodiscard]] images::Cards band_cards(const std::vector<SpectralBand>& bands);

} // namespace obscura::host
