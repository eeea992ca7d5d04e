// SPDX-License-Identifier: Apache-2.0
// Facets of a shape that face both the Sun and the camera, for sampling them by area.
#pragma once

#include "core/geometry.hpp"
#include "renderer/shapes/triangle_corners.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

namespace obscura::renderer {

class FacetSet;
class Shape;

/// Facets that may be seen in sunlight, each with its weight: its projected area times the cosine of the
/// Sun's angle. Where much is in shadow or hidden, cells of equal weight are tested with a few rays, and
/// those where no ray gets through are sampled less often. Valid for some neighbourhood of the directions
/// that it was made for: every facet of which any part may be lit and visible has a weight. Immutable;
/// thread-safe.
class LitFacets {
public:
    /// Directions to the camera and to the Sun (body frame) in steps of 1/512, and how far those to any
    /// point of the body and of the Sun's disc may be from them, as sines in the same steps.
    struct Directions {
        std::array<std::int32_t, 3> camera{}, sun{};
        std::int32_t camera_slack = 0, sun_slack = 0;
        /// They shine by more than sunlight: weights do not fall to 0 towards the terminator.
        bool other_light = false;
        bool operator==(const Directions&) const = default;
    };

    /// `set` must outlive the list.
    LitFacets(const FacetSet& set, const Directions& directions);

    [[nodiscard]] bool empty() const { return sums_.empty(); }
    /// Whether a facet has a weight.
    [[nodiscard]] bool has(std::uint32_t triangle) const {
        return (listed_[triangle / 64] >> (triangle % 64) & 1u) != 0;
    }

    /// A uniformly sampled point of a facet.
    struct Point {
        Vec3 position_m;
        Vec3 area_m2; ///< normal of the facet times its area, over its share of the weight
        std::uint32_t triangle = 0;
    };
    /// Where the last sample was found, for the next one.
    struct Cursor {
        std::size_t cell = 0, facet = 0;
    };
    /// Samples a facet from u, and a point of it by the remainder of u and by v, u and v in [0,1). Ascending
    /// `u`, for which alone a cursor holds, are stratified over the surface.
    [[nodiscard]] Point sample(double u, double v, Cursor& cursor) const;
    [[nodiscard]] std::size_t size() const { return sums_.size(); }

private:
    /// As sample(), by the weights alone.
    [[nodiscard]] Point sample_weights(double u, double v, std::size_t& facet) const;
    /// Tests the cells for sunlight in view; sets `cells_`.
    void test_cells(Vec3 camera, Vec3 sun, double sun_slack);

    const FacetSet& set_;
    std::vector<double> cells_;            ///< cumulative shares of the samples; empty: all equal
    std::vector<double> sums_;             ///< cumulative weights
    std::vector<std::uint32_t> triangles_; ///< one for each
    std::vector<std::uint64_t> listed_;    ///< by triangle, a bit each
};

/// All facets of a shape, ordered along a space-filling curve (Morton). Thread-safe.
class FacetSet {
public:
    /// Corners of a triangle, and its shading normals at them (all three 0: the facet's own).
    using Corners = std::function<TriangleCorners(std::uint32_t)>;

    struct Facet {
        float area_x, area_y, area_z; ///< outer normal times area, m2
        std::uint32_t triangle;
        std::array<std::array<std::int16_t, 3>, 3> normals; ///< shading normals at the corners, unit: 32767
    };

    /// Facets of `shape`, which may still be under construction and keeps the set. `corners` is kept too;
    /// `normals` may be empty.
    FacetSet(const Shape& shape, std::uint32_t triangles, Corners corners, const Corners& normals);

    /// Facets that have an area.
    [[nodiscard]] std::span<const Facet> facets() const { return facets_; }
    /// Number of facets, with those that have no area.
    [[nodiscard]] std::size_t triangle_count() const { return triangle_count_; }
    /// Whether the surface is closed and its normals point outwards: the inner sides are never seen.
    [[nodiscard]] bool closed() const { return closed_; }
    [[nodiscard]] TriangleCorners corners(std::uint32_t triangle) const { return corners_(triangle); }
    [[nodiscard]] const Shape& shape() const { return shape_; }
    /// Memory of the facets, without that of lists.
    [[nodiscard]] std::size_t bytes() const { return facets_.capacity() * sizeof(Facet); }

    /// The facets, the same whether there is other light, that a camera at `camera_m` may see in the light of
    /// a Sun at `sun_m` (body frame). Lists are kept for calls with about the same directions.
    [[nodiscard]] std::shared_ptr<const LitFacets> lit(Vec3 camera_m, Vec3 sun_m, double sun_radius_m,
                                                       bool other_light = false) const;

private:
    struct Kept {
        LitFacets::Directions directions;
        std::shared_ptr<const LitFacets> list;
        std::uint64_t used = 0;
    };

    const Shape& shape_;
    Corners corners_;
    std::size_t triangle_count_;
    std::vector<Facet> facets_;
    double radius_m_ = 0;
    bool closed_ = false;
    mutable std::mutex mutex_;
    mutable std::vector<Kept> kept_;
    mutable std::uint64_t calls_ = 0;
};

} // namespace obscura::renderer
