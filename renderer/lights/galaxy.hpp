// SPDX-License-Identifier: Apache-2.0
// Galaxy as points of equal light, by Sersic's profile; axes on the sky.
#pragma once

#include "renderer/scene/sky_object.hpp"

#include <vector>

namespace obscura::renderer {

/// Unit vectors at a place on the sky: towards it, east and north.
struct SkyTangents {
    SkyTangents(double right_ascension_rad, double declination_rad);
    Vec3 centre, east, north;
};

/// Directions (unit, inertial) of points of equal light that make up a galaxy: gnomonic about its centre.
[[nodiscard]] std::vector<Vec3> galaxy_points(const scene::SkyObject& galaxy);

} // namespace obscura::renderer
