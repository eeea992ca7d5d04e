// SPDX-License-Identifier: Apache-2.0
// A convex hull of few planes about a mesh: tells pixels that cannot see it from those that may.
#pragma once

#include "core/geometry.hpp"
#include "renderer/mesh_files/triangle_mesh.hpp"
#include "renderer/packets/packet.hpp"

#include <array>

namespace obscura::renderer {

/// The 13 pairs of parallel planes across the faces, edges and corners of a cube, moved in until they touch
/// the mesh (a "26-DOP": Klosowski et al., IEEE TVCG 4(1), 1998).
class Hull {
public:
    static constexpr std::size_t axes = 13;

    explicit Hull(const TriangleMesh& mesh);

    /// Switches off the active rays that pass the hull, and that any ray turned by up to `slack_rad` about
    /// the same origin passes as well.
    void cull(const RayPacket& rays, double slack_rad, Lanes& near) const;

private:
    std::array<Vec3, axes> axis_;
    std::array<double, axes> least_, most_;
    double radius_ = 0;
};

} // namespace obscura::renderer
