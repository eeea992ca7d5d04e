// SPDX-License-Identifier: Apache-2.0
// Height field on the cube sphere with a pyramid of maxima: exact first crossings of rays, in double
// precision.
#pragma once

#include "core/geometry.hpp"
#include "renderer/packets/packet.hpp"
#include "terrain/cube_sphere.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace obscura::renderer {

/// Surface |p| = 1 + H(direction of p) around the unit sphere. H is given at the vertices of a square grid of
/// cells on each face of a gnomonic cube sphere and is bilinear in u and v within a cell, thus continuous,
/// across the edges of faces too. A body with three radii is scaled to it, which leaves radial lines radial
/// and distances along a ray unchanged. Immutable; thread-safe; the queries do not allocate.
///
/// Rays descend a quadtree of maxima from front to back (Tevs, Ihrke, Seidel, Maximum Mipmaps for Fast,
/// Accurate, and Scalable Dynamic Height Field Rendering, I3D 2008). All borders of cells are planes through
/// the centre, so that a ray's interval in a node is split at its two middle planes without gap or overlap:
/// no ray slips through between cells, levels or faces.
class HeightField {
public:
    /// Point where a ray meets the surface.
    struct Crossing {
        double t = no_hit;      ///< along the ray, in units of its direction
        std::uint32_t cell = 0; ///< number of the cell
        double s = 0, r = 0;    ///< place in the cell along u and v, 0 to 1
    };
    /// Gradients of |p| - 1 - H, outwards, not normalised.
    struct Gradients {
        Vec3 facet;  ///< of the bilinear patch
        Vec3 smooth; ///< from central differences at the vertices, interpolated: continuous
    };

    static constexpr std::uint32_t most_cells_per_edge = 8192;

    /// Samples `height` at the unit direction of each vertex, by several threads. `cells_per_edge`: of a
    /// face, a power of two from 2 to most_cells_per_edge. Heights must be above -0.9 and below 10.
    HeightField(std::uint32_t cells_per_edge, const std::function<double(Vec3)>& height);

    /// Bytes that a field of that size takes.
    [[nodiscard]] static std::uint64_t bytes(std::uint32_t cells_per_edge);

    [[nodiscard]] std::uint32_t cells_per_edge() const { return cells_; }
    /// Smallest and largest height of all vertices.
    [[nodiscard]] double least() const { return least_; }
    [[nodiscard]] double largest() const { return largest_; }

    /// The first crossing of the ray at 0 < t < t_max, from outside to inside, or, if its origin is below the
    /// surface, from inside to outside. `direction`: any length above 0.
    [[nodiscard]] Crossing first_crossing(Vec3 origin, Vec3 direction, double t_max) const;

    /// H in the direction of `p`.
    [[nodiscard]] double height(Vec3 p) const;
    /// The surface's gradients at place (s, r) of a cell.
    [[nodiscard]] Gradients gradients(std::uint32_t cell, double s, double r) const;

private:
    struct Ray;
    struct Patch;

    [[nodiscard]] const float* vertex(std::size_t face, std::uint32_t i, std::uint32_t j) const {
        return heights_.data() + (face * stride_ + j + 1) * stride_ + i + 1;
    }
    [[nodiscard]] Patch patch(std::size_t face, std::uint32_t i, std::uint32_t j) const;
    [[nodiscard]] float maximum(std::size_t face, int level, std::uint32_t i, std::uint32_t j) const;
    void make_maxima();
    // The first crossing between two places on the ray; false: none.
    bool cross_shell(const Ray& ray, double from, double to, bool inside, Crossing& found) const;
    bool cross_face(const Ray& ray, std::size_t face, double from, double to, bool inside,
                    Crossing& found) const;

    std::uint32_t cells_;
    int levels_; ///< log2 of cells_
    std::size_t stride_;
    double least_ = 0, largest_ = 0;
    std::vector<float> heights_; ///< per face (cells + 3)^2: one vertex of margin on each side
    /// Per face, levels 1 to levels_: largest height of 2^level x 2^level cells.
    std::vector<float> maxima_;
    std::vector<std::size_t> level_offset_; ///< of each level in a face's maxima
    std::size_t maxima_per_face_ = 0;
};

} // namespace obscura::renderer
