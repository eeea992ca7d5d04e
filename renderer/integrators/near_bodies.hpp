// SPDX-License-Identifier: Apache-2.0
// Culling of bodies by direction: which of 16 directions may meet a body.
#pragma once

#include "renderer/packets/packet.hpp"
#include "renderer/world/instants.hpp"

namespace obscura::renderer {

/// Sets `near` to those of 16 directions (unit, camera frame) that lie within the squared chord `chord2` of
/// `axis`; whether there are any.
bool near_axis(const Vec3s& direction, Vec3 axis, double chord2, Lanes& near);

/// Sets `near` to those directions that may meet `body` when turned by up to `slack_rad`; `chord2`: the
/// squared chord of its cone and that angle. Of targeted bodies the cone alone is tested. Whether there are
/// any.
bool near_body(const BodyState& body, const Vec3s& direction, double chord2, double slack_rad, Lanes& near);

/// Sets `near` to those directions that lie within the body's cone, widened by RowState::reach_rad, each lane
/// at its own instant; no lane is near where the body is targeted. Whether there are any.
bool near_cone_at(const Instants& instants, std::int32_t body, const Words& instant, const Vec3s& direction,
                  Lanes& near);
/// Leaves those of `near` that may meet the body itself, for the same arguments. Costs about as much as a ray
/// that misses the body.
bool near_hull_at(const Instants& instants, std::int32_t body, const Words& instant, const Vec3s& direction,
                  Lanes& near);

} // namespace obscura::renderer
