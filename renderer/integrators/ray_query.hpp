// SPDX-License-Identifier: Apache-2.0
// Ray queries: distances along rays from anywhere to the nearest surface.
#pragma once

#include "core/geometry.hpp"

#include <span>

namespace obscura::renderer {

struct RowState;

/// Fills `distances_m`, one for each ray, with the distance to the nearest body of `row`; no_hit: none.
/// Origins and unit vectors are inertial.
void nearest_distances(const RowState& row, std::span<const Vec3> origins_m, std::span<const Vec3> directions,
                       std::span<double> distances_m);

} // namespace obscura::renderer
