// SPDX-License-Identifier: Apache-2.0
// False-colour pictures of the layers of a rendered image: depth, normal, slope, error and other AOVs.
#pragma once

#include "images/writers/fits.hpp"
#include "tools/pictures/figure.hpp"

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::tools {

/// Names of the layers that can be shown.
[[nodiscard]] std::vector<std::string> layer_choices();

/// Planes of a rendered image.
struct LayerPlanes {
    std::int32_t width = 0, height = 0;
    std::span<const images::FitsPlane> planes; ///< AOVs, "samples" and "variance", by the names in files
    std::span<const float> irradiance;         ///< mean over the spectral bands; for the layer "error"
    std::vector<std::string> bodies;           ///< names, for the legend
};

/// The layer `name` of layer_choices(), with a colour bar or legend.
[[nodiscard]] Panel layer_panel(std::string_view name, const LayerPlanes& planes);

} // namespace obscura::tools
