// SPDX-License-Identifier: Apache-2.0
// What stands in for files that the published program ships, which are not public.
#pragma once

#include "serve/compatible/dem_file.hpp"

#include <nlohmann/json.hpp>

#include <optional>
#include <string>

namespace obscura::serve::compatible {

/// Keys of the shape that stands in for a mesh file; none: no shape does.
[[nodiscard]] std::optional<nlohmann::json> stand_in_mesh(const std::string& name);
/// Elevation model without heights; none: no body does.
[[nodiscard]] std::optional<DemFile> stand_in_dem(const std::string& name);
/// Whether a texture is one of that program's: white stands in for it.
[[nodiscard]] bool is_program_texture(const std::string& name);

} // namespace obscura::serve::compatible
