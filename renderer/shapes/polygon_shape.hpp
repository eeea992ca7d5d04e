// SPDX-License-Identifier: Apache-2.0
// Surface of flat faces in double precision throughout, for few faces at any distance from the origin.
#pragma once

#include "renderer/shapes/area_sampler.hpp"
#include "renderer/shapes/hull.hpp"
#include "renderer/shapes/lit_facets.hpp"
#include "renderer/shapes/shape.hpp"
#include "renderer/shapes/triangle_corners.hpp"
#include "renderer/shapes/triangle_list.hpp"

#include <memory>
#include <vector>

namespace obscura::renderer {

/// Triangles in the order of the faces, in lists that are tested one after the other.
class PolygonShape final : public Shape {
public:
    /// `triangles`: at least one, each with an area. Their area can be sampled if they `emit`.
    explicit PolygonShape(std::vector<TriangleCorners> triangles, bool emit = false);

    [[nodiscard]] double bounding_radius_m() const override { return bounding_radius_m_; }
    [[nodiscard]] bool shadows_itself() const override { return true; }
    void cull(const RayPacket& rays, double slack_rad, Lanes& near) const override {
        hull_.cull(rays, slack_rad, near);
    }
    void intersect(const RayPacket& rays, std::int32_t body, HitPacket& hits) const override;
    /// All hits, also of the surface on which a ray starts.
    void intersect_all(const RayPacket& rays, std::int32_t body, HitPacket& hits) const;
    void occlude(RayPacket& rays) const override;
    void surface(const RayPacket& rays, const HitPacket& hits, std::int32_t body,
                 SurfacePacket& out) const override;
    [[nodiscard]] double sampled_area_m2() const override { return sampler_.area_m2(); }
    void sample_area(double u, double v, Vec3& position, Vec3& normal) const override {
        sampler_.sample(u, v, position, normal);
    }
    [[nodiscard]] const FacetSet* facets() const override { return facets_.get(); }

private:
    std::vector<TriangleCorners> triangles_;
    std::vector<TriangleList> lists_; ///< relative to centre_
    /// Near the faces if these are far from the body's origin, else the origin: barycentric coordinates are
    /// as exact as doubles of the faces' own size.
    Vec3 centre_;
    double bounding_radius_m_ = 0;
    double extent_m_ = 0; ///< diagonal of the bounding box
    Hull hull_;
    AreaSampler sampler_;
    std::unique_ptr<const FacetSet> facets_;
};

} // namespace obscura::renderer
