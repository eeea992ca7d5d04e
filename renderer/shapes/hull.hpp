// SPDX-License-Identifier: Apache-2.0
// Bounding 26-DOP of a mesh: culls rays that cannot meet it.
#pragma once

#include "core/geometry.hpp"
#include "renderer/packets/packet.hpp"

#include <array>

namespace obscura::renderer {

/// 26-DOP: 13 pairs of parallel planes that touch the mesh, across the faces, edges and corners of a cube
/// (Klosowski et al., IEEE TVCG 4(1), 1998).
class Hull {
public:
    static constexpr std::size_t axes = 13;

    Hull();
    /// Widens the hull to a point of the mesh.
    void include(Vec3 point);

    /// Switches off lanes of `near` whose rays pass the hull, also when turned by up to `slack_rad` about
    /// their common origin.
    void cull(const RayPacket& rays, double slack_rad, Lanes& near) const;

private:
    std::array<Vec3, axes> axis_;
    std::array<double, axes> least_, most_;
    double radius_ = 0;
};

} // namespace obscura::renderer
