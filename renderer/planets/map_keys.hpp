// SPDX-License-Identifier: Apache-2.0
// Keys of the place of a map on a planet or terrain: those that tables of heights and of albedo share.
#pragma once

#include "config/section.hpp"
#include "terrain/maps/map_source.hpp"

namespace obscura::renderer {

/// Projection, registration, latitudes and edges; `map` must outlive them.
[[nodiscard]] config::Keys map_keys(terrain::MapKeys& map);

/// Reports keys that the projection of the table does not have, and those that it wants.
void check_map_keys(const terrain::MapKeys& map, const config::ReadTable& table);

} // namespace obscura::renderer
