// Irradiance images as channels of an EXR file.
#pragma once

#include "images/writers/exr.hpp"
#include "renderer/scene/scene.hpp"

#include <span>
#include <vector>

namespace obscura::tools {

/// One channel per band, "irradiance.400-900nm" and so on, of planes that lie one behind the other in
/// `image`, which must outlive the channels.
[[nodiscard]] std::vector<images::ExrChannel> irradiance_channels(std::span<const float> image,
                                                                  const std::vector<SpectralBand>& bands);

/// The limits of the bands as header cards B0_FROM, B0_TO, ...
[[nodiscard]] images::Cards band_cards(const std::vector<SpectralBand>& bands);

} // namespace obscura::tools
