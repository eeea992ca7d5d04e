// Irradiance images as channels of an EXR file.
#pragma once

#include "core/scene.hpp"
#include "transports/file/exr.hpp"

#include <span>
#include <vector>

namespace obscura::tools {

/// One channel per band, "irradiance.400-900nm" and so on, of planes that lie one behind the other in
/// `image`, which must outlive the channels.
[[nodiscard]] std::vector<transports::ExrChannel>
irradiance_channels(std::span<const float> image, const std::vector<scene::SpectralBand>& bands);

/// The limits of the bands as header cards B0_FROM, B0_TO, ...
[[nodiscard]] transports::Cards band_cards(const std::vector<scene::SpectralBand>& bands);

} // namespace obscura::tools
