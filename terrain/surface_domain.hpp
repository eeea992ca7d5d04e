// SPDX-License-Identifier: Apache-2.0
// Reference surface that heights count from, an ellipsoid or a plane, and its quadtree of square tiles.
#pragma once

#include "core/geometry.hpp"

#include <compare>
#include <cstddef>
#include <cstdint>

namespace obscura::terrain {

/// Cells along the edge of a tile; its vertices are one more, and one more again on each side as a margin.
inline constexpr int tile_cells = 256;
inline constexpr int tile_margin = 1;
inline constexpr int tile_edge = tile_cells + 1 + 2 * tile_margin;
inline constexpr std::size_t tile_vertices = std::size_t{tile_edge} * tile_edge;
/// Deepest level of tiles: cells of a millimetre on the Moon.
inline constexpr int deepest_level = 23;

/// Name of a tile: tile (i, j) of the 2^level by 2^level tiles of a face, i along u and j along v.
struct TileKey {
    std::uint8_t face = 0, level = 0;
    std::uint32_t i = 0, j = 0;

    constexpr auto operator<=>(const TileKey&) const = default;

    [[nodiscard]] constexpr TileKey parent() const {
        return {face, static_cast<std::uint8_t>(level - 1), i / 2, j / 2};
    }
    /// `quarter`: 0 to 3, bit 0 along u, bit 1 along v.
    [[nodiscard]] constexpr TileKey child(unsigned quarter) const {
        return {face, static_cast<std::uint8_t>(level + 1), 2 * i + (quarter & 1), 2 * j + (quarter >> 1)};
    }
};

/// Ellipsoid about the origin of the body frame under the six faces of a gnomonic cube sphere
/// (cube_sphere.hpp; heights along the direction from the centre), or a square of the plane z = 0 (one face,
/// u along x and v along y; heights along z). u and v go from -1 to 1.
class SurfaceDomain {
public:
    /// Place on a face.
    struct Place {
        std::uint8_t face = 0;
        double u = 0, v = 0;
    };

    [[nodiscard]] static SurfaceDomain ellipsoid(Vec3 radii_m);
    /// x and y from -half_edge_m to half_edge_m.
    [[nodiscard]] static SurfaceDomain plane(double half_edge_m);

    [[nodiscard]] bool is_plane() const { return half_edge_m_ > 0; }
    /// Semi-axes of the ellipsoid, m.
    [[nodiscard]] Vec3 radii_m() const { return radii_m_; }
    [[nodiscard]] double half_edge_m() const { return half_edge_m_; }
    [[nodiscard]] std::uint8_t faces() const { return is_plane() ? 1 : 6; }

    /// Point of the reference surface, m. Points of edges and corners of faces are the same, bit for bit,
    /// from every face that has them. Slightly beyond the edge of a face, points of its neighbour: at u = 1 +
    /// e that of the neighbour's coordinate 1 - e across the same edge, so that faces share the vertices on
    /// both sides of it; a plane goes on.
    [[nodiscard]] Vec3 point(std::uint8_t face, double u, double v) const;
    /// Place of a point of the reference surface, or above or below it.
    [[nodiscard]] Place place_of(Vec3 position_m) const;
    /// The tile of a level that has a place; one, also on its edges.
    [[nodiscard]] static TileKey tile_at(const Place& place, int level);
    /// u of vertex 0..tile_cells of a tile, likewise v with `index` j. Exact: the same from every tile and
    /// level that has the vertex.
    [[nodiscard]] static double coordinate(int level, std::uint32_t index, int vertex);
    /// Largest semi-axis or half edge, m: the unit of the scaled space in which rays are traced.
    [[nodiscard]] double unit_m() const;
    /// Distance of neighbouring vertices of that level, m: the largest on the surface (for an ellipsoid, in
    /// the middle of a face and by the largest radius).
    [[nodiscard]] double spacing_m(int level) const;

private:
    Vec3 radii_m_{};
    double half_edge_m_ = 0;
};

} // namespace obscura::terrain
