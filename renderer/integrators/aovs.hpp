// SPDX-License-Identifier: Apache-2.0
// AOVs (truth maps): the geometry behind the centre of each pixel, beside a frame's irradiance.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace obscura::renderer {

class Projection;
struct RowState;

/// Arbitrary output variables, in the order in which Renderer::render_aovs() writes their planes.
enum class Aov : std::uint8_t {
    body,     ///< 0: none; 1 ..: the scene's bodies in order; one more: the Sun
    range_m,  ///< from the camera to the surface
    depth_m,  ///< range along the boresight
    normal_x, ///< shading normal, unit, inertial axes, towards the camera
    normal_y,
    normal_z,
    latitude_deg,  ///< planetocentric, body frame: angle from the x-y plane, positive to +z
    longitude_deg, ///< body frame: from +x towards +y, -180 .. 180
    slope_deg,     ///< between the normal and Shape::up()
    incidence_deg, ///< between the normal and the centre of the Sun
    emission_deg,  ///< between the normal and the camera
    phase_deg,     ///< Sun, surface, camera
    u,             ///< texture coordinates, right and down; NaN where the body has none
    v,
    albedo,   ///< normal albedo, pi times the reflectance at no incidence, emission and phase, first band
    material, ///< the materials of all bodies in order, from 1; one more than those: the Sun
};
constexpr std::size_t aov_count = 16;
/// Layer name in files: "body", "range_m", "normal.x", ...
[[nodiscard]] const char* aov_name(Aov aov);

/// Fills the AOVs of the pixels [x, x + width) of row `y`: AOV k at out + k * plane. One ray through the
/// centre of each pixel, without PSF; textures are filtered over rays `ray_width_rad` wide. `candidates` is
/// scratch space.
void trace_aovs(const Projection& projection, const RowState& row, std::int32_t x, std::int32_t y,
                std::int32_t width, double ray_width_rad, std::vector<std::int32_t>& candidates, float* out,
                std::size_t plane);

} // namespace obscura::renderer
