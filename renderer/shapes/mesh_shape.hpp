// SPDX-License-Identifier: Apache-2.0
// Triangle mesh in an Embree scene of its own, in the body frame.
#pragma once

#include "renderer/mesh_files/triangle_mesh.hpp"
#include "renderer/shapes/area_sampler.hpp"
#include "renderer/shapes/embree_compat.hpp"
#include "renderer/shapes/hull.hpp"
#include "renderer/shapes/lit_facets.hpp"
#include "renderer/shapes/shape.hpp"
#include "renderer/shapes/triangle_list.hpp"

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <type_traits>
#include <vector>

namespace obscura::renderer {

/// The Embree device, shared by all meshes of a renderer.
class EmbreeDevice {
public:
    /// Throws Error when Embree cannot start.
    EmbreeDevice();
    EmbreeDevice(const EmbreeDevice&) = delete;
    EmbreeDevice& operator=(const EmbreeDevice&) = delete;

    /// Memory that Embree reports as allocated, in bytes.
    [[nodiscard]] std::int64_t bytes() const { return bytes_.load(); }
    [[nodiscard]] RTCDevice get() const { return device_.get(); }
    [[nodiscard]] bool has_16_wide() const { return has_16_wide_; }

private:
    struct Release {
        void operator()(RTCDevice d) const { rtcReleaseDevice(d); }
    };
    /// Declared before the device, which updates it until it is released.
    std::atomic<std::int64_t> bytes_{0};
    std::unique_ptr<std::remove_pointer_t<RTCDevice>, Release> device_;
    bool has_16_wide_ = false;
};

/// Embree works in floats, so each ray's origin is first moved, in double precision, to where it enters the
/// body's bounding sphere: coordinates that Embree sees are never larger than the body, at any distance of
/// the camera.
class MeshShape final : public Shape {
public:
    /// `mesh` must have passed validate(). Its area can be sampled if it `emits`.
    MeshShape(std::shared_ptr<const EmbreeDevice> device, TriangleMesh mesh, bool emits = false);

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

    bool texture_coordinates(const HitPacket& hits, std::int32_t body, const SurfacePacket& surface,
                             UvPacket& out) const override;
    [[nodiscard]] std::size_t material_slot(std::uint32_t primitive) const override {
        return mesh_.material_slots.empty() ? 0 : mesh_.material_slots[primitive];
    }

    [[nodiscard]] double sampled_area_m2() const override { return sampler_.area_m2(); }
    void sample_area(double u, double v, Vec3& position, Vec3& normal) const override {
        sampler_.sample(u, v, position, normal);
    }

    [[nodiscard]] const FacetSet* facets() const override { return facets_.get(); }

    [[nodiscard]] const TriangleMesh& mesh() const { return mesh_; }
    /// Memory of the mesh's own arrays; that of Embree's tree counts with the device.
    [[nodiscard]] std::int64_t bytes() const;

private:
    /// Builds Embree's tree over the triangles.
    void build_tree();

    struct Release {
        void operator()(RTCScene s) const { rtcReleaseScene(s); }
    };

    std::shared_ptr<const EmbreeDevice> device_;
    TriangleMesh mesh_;
    std::unique_ptr<std::remove_pointer_t<RTCScene>, Release> scene_;
    double bounding_radius_m_ = 0;
    Hull hull_;
    AreaSampler sampler_;                       ///< of a mesh that emits
    std::optional<TriangleList> triangle_list_; ///< instead of Embree's tree
    std::unique_ptr<const FacetSet> facets_;
};

} // namespace obscura::renderer
