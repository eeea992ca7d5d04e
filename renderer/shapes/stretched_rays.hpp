// SPDX-License-Identifier: Apache-2.0
// Rays whose distances are not lengths in the body frame: see RayPacket::stretch.
#pragma once

#include "renderer/shapes/shape.hpp"

namespace obscura::renderer {

/// As Shape::intersect(), with the distances of `hits` in the unit of RayPacket::stretch.
void intersect_stretched(const Shape& shape, const RayPacket& rays, std::int32_t body, HitPacket& hits);

/// Brings RayPacket::t_max from that unit to lengths in the body frame.
void stretch_limits(RayPacket& rays);

/// `hits` with lengths in the body frame, for the other functions of shapes: itself, or `scratch`.
[[nodiscard]] const HitPacket& hits_in_frame(const RayPacket& rays, const HitPacket& hits,
                                             HitPacket& scratch);

} // namespace obscura::renderer
