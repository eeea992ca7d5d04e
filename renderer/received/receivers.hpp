// SPDX-License-Identifier: Apache-2.0
// Receivers: the patches of a body's surface on which received light is counted, and points of them.
#pragma once

#include "core/geometry.hpp"
#include "renderer/packets/packet.hpp"
#include "renderer/packets/sampler.hpp"
#include "renderer/world/row_state.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace obscura::renderer {

/// A facet of a mesh, or a cell between two meridians and two parallels, in the body frame.
struct Patch {
    Vec3 centre_m;
    Vec3 normal;        ///< outer, unit
    double area_m2 = 0; ///< 0: it receives nothing
};

/// Points of up to 16 patches, one lane each, in the body frame.
struct PatchPoints {
    SurfacePacket surface;
    RayPacket view; ///< a ray from outside to each point, and its hit
    HitPacket hits;
    Doubles area_m2; ///< part of the patch that the point stands for; 0: none
    std::size_t patch[packet_size];
    std::size_t count = 0; ///< lanes in use
};

/// Point `index` in four dimensions of each seed: stratified over a patch and the directions from it
/// together. `number` tells draws of one kind apart.
void draw(const Words& seeds, std::uint32_t number, std::uint32_t index, Doubles (&out)[4]);

/// Patches of one body: the facets of a shape that has them, by their numbers; else cells of equal angles of
/// longitude and latitude, rows from north to south, columns from longitude -180 degrees. Cells are of
/// surfaces that each ray to the origin meets once. Refers to the body; thread-safe.
class Receivers {
public:
    /// `index`: number of the body in the hits of its shape. `rows`: cells from pole to pole; columns are
    /// twice as many.
    Receivers(const BuiltBody& body, std::int32_t index, std::size_t rows);

    [[nodiscard]] bool facets() const { return rows_ == 0; }
    /// Cells from pole to pole; 0: facets().
    [[nodiscard]] std::size_t rows() const { return rows_; }
    [[nodiscard]] std::span<const Patch> patches() const { return patches_; }
    [[nodiscard]] double area_m2() const { return area_m2_; }
    /// Corners of a patch, three of a facet, four of a cell, counter-clockwise from outside. Of a cell they
    /// are on the surface.
    [[nodiscard]] std::vector<Vec3> corners(std::size_t patch) const;

    /// Number of packets of points() that go over all patches once, neighbours together.
    [[nodiscard]] std::size_t packets() const { return (order_.size() + packet_size - 1) / packet_size; }
    /// Points of the patches of a packet: one of each, at `u`, `v` in [0,1) of it, standing for 1 / `of` of
    /// its area.
    void points(std::size_t packet, const Doubles& u, const Doubles& v, std::uint32_t of,
                PatchPoints& out) const;
    /// Patch of a hit.
    [[nodiscard]] std::size_t patch_at(std::uint32_t primitive, Vec3 position_m) const;
    /// What random numbers of a patch are for.
    enum class Draw : std::uint8_t { direct, near, far };
    /// Seeds of the patches of a packet, for draw().
    void seeds(std::size_t packet, std::uint64_t seed, Draw what, Words& out) const;

private:
    void facet_rays(const Doubles& u, const Doubles& v, std::uint32_t of, PatchPoints& out) const;
    void cell_rays(const Doubles& u, const Doubles& v, std::uint32_t of, PatchPoints& out) const;

    const Shape& shape_;
    std::int32_t index_;
    std::size_t rows_ = 0;
    double radius_m_ = 0; ///< of a sphere outside the surface
    double area_m2_ = 0;
    std::vector<Patch> patches_;
    std::vector<std::uint32_t> order_; ///< patches that have an area, along a curve
};

} // namespace obscura::renderer
