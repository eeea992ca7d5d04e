// SPDX-License-Identifier: Apache-2.0
// Sky cells: the celestial sphere on the faces of a cube, each divided into equal squares.
#pragma once

#include "core/geometry.hpp"

#include <cstdint>
#include <vector>

namespace obscura::ephemeris {

/// Place of a direction on the cube about the sphere. Faces 0, 1, 2 hold the directions whose largest
/// component is +x, +y, +z, faces 3, 4, 5 those of -x, -y, -z.
struct FacePoint {
    std::uint32_t face = 0;
    double u = 0,
           v = 0; ///< -1 .. 1: the next two components, in the order x, y, z, x, over the largest's size
};
[[nodiscard]] FacePoint face_point(Vec3 direction) noexcept;
/// Unit direction of a place.
[[nodiscard]] Vec3 direction_of(FacePoint at) noexcept;

/// Grid of cells on the cube's faces, in groups of 4 x 4 cells. Immutable; thread-safe.
class SkyCells {
public:
    static constexpr std::uint32_t min_edge = 4, max_edge = 512, group_edge = 4;

    /// `edge`: cells along the edge of a face, a multiple of group_edge within these limits.
    explicit SkyCells(std::uint32_t edge);

    [[nodiscard]] std::uint32_t edge() const noexcept { return edge_; }
    /// Number of cells. The cells of a group are neighbours in their order.
    [[nodiscard]] std::uint32_t count() const noexcept { return 6 * edge_ * edge_; }
    [[nodiscard]] std::uint32_t cell_of(FacePoint at) const noexcept;

    /// Cone of directions.
    struct Cone {
        Vec3 axis; ///< unit
        double half_angle_rad;
    };
    /// Calls `use(cell)` for each cell that may have directions within the cone. Real-time safe if `use` is.
    template<typename Use>
    void for_each_near(const Cone& cone, const Use& use) const {
        const Reach reach(cone);
        const std::uint32_t per_group = group_edge * group_edge;
        for (std::uint32_t group = 0; group < groups_.size(); ++group) {
            if (!reach.meets(groups_[group])) continue;
            for (std::uint32_t cell = group * per_group; cell < (group + 1) * per_group; ++cell)
                if (reach.meets(cells_[cell])) use(cell);
        }
    }

private:
    /// Circle on the sphere about a cell or group.
    struct Circle {
        float x, y, z;      ///< centre, unit
        float cosine, sine; ///< of its radius
    };
    /// Test of circles against a cone.
    class Reach {
    public:
        explicit Reach(const Cone& cone) noexcept;
        [[nodiscard]] bool meets(const Circle& c) const noexcept {
            constexpr double margin = 1e-6; // the circles are floats
            // The cone and the circle together are at least half the sphere.
            if (cosine_ * c.sine + sine_ * c.cosine <= 0 && cosine_ < c.cosine) return true;
            return axis_.x * c.x + axis_.y * c.y + axis_.z * c.z >=
                   cosine_ * c.cosine - sine_ * c.sine - margin;
        }

    private:
        Vec3 axis_;
        double cosine_, sine_;
    };
    [[nodiscard]] static Circle circle(std::uint32_t face, double u, double v, double width);

    std::uint32_t edge_;
    std::vector<Circle> groups_, cells_;
};

} // namespace obscura::ephemeris
