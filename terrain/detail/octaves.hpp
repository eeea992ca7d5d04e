// SPDX-License-Identifier: Apache-2.0
// Layer of noise octaves whose roughness follows a table of slope against baseline.
#pragma once

#include "terrain/detail/gradient_noise.hpp"
#include "terrain/detail/slope_loss.hpp"
#include "terrain/detail/slope_table.hpp"
#include "terrain/height_layer.hpp"

#include <cstdint>
#include <functional>
#include <vector>

namespace obscura::terrain {

/// Adds the octaves that are shorter than the samples below and not shorter than two vertices. Each octave is
/// sampled, four to eight samples per lattice spacing, at the vertices of the quadtree's level of that size
/// (or of the grid's own) and refined to the grid by the four-point scheme of Dyn, Levin and Gregory (A
/// 4-point interpolatory subdivision scheme, CAGD 4, 1987): an octave costs a fourth of the next shorter one,
/// and vertices that two levels have in common keep their heights but for octaves that only the finer one
/// has.
class Octaves final : public HeightLayer {
public:
    /// The longest octave has lattice spacings of at most twice the longest baseline and of the radius (half
    /// the edge of a plane); the shortest, of two cells of the deepest level, or a millimetre. `made_m2`:
    /// as solve_octaves takes it; none: 0. `over_maps`: there may be layers of samples below.
    Octaves(const SurfaceDomain& domain, const SlopeTable& table, std::uint64_t seed, bool over_maps,
            const std::function<double(double)>& made_m2 = {});

    void apply(const VertexGrid& grid, std::span<double> heights_m,
               std::span<double> sample_spacings_m) const override;
    [[nodiscard]] HeightRange range(const Cap& cap, double spacing_m, HeightRange below) const override;
    [[nodiscard]] double sample_spacing_m(Vec3 /*position_m*/) const override { return 0; }
    void add_lost_slopes(std::span<const Vec3> positions_m, double spacing_m,
                         std::span<const double> sample_spacings_m, std::span<double> lost) const override;

    /// Longest first.
    [[nodiscard]] const std::vector<Octave>& octaves() const { return octaves_; }
    /// Share of an octave of lattice spacing 2^exponent that is added where the samples below are 2 to the
    /// power `log2_spacing` m apart: 1 for an infinite distance.
    [[nodiscard]] static double share(int exponent, double log2_spacing);

private:
    /// Vertices i0 to i1 and j0 to j1 of a level, numbered from the face's corner; outside of the face its
    /// plane goes on.
    struct Region {
        std::int64_t i0, i1, j0, j1;
        [[nodiscard]] std::size_t columns() const { return static_cast<std::size_t>(i1 - i0 + 1); }
        [[nodiscard]] std::size_t rows() const { return static_cast<std::size_t>(j1 - j0 + 1); }
        [[nodiscard]] std::size_t size() const { return columns() * rows(); }
        /// What refining to this region takes from the next coarser level.
        [[nodiscard]] Region coarser() const;
    };
    /// Sum of the octaves from number `first` to before `last`, at a region of a level. `positions_m`: of the
    /// region's vertices; empty: not known.
    [[nodiscard]] std::vector<double> sum(std::uint8_t face, int level, const Region& region,
                                          std::size_t first, std::size_t last,
                                          std::span<const Vec3> positions_m) const;
    [[nodiscard]] static std::vector<double> refined(std::span<const double> coarse, const Region& from,
                                                     const Region& to);
    [[nodiscard]] std::vector<Vec3> positions(std::uint8_t face, int level, const Region& region) const;
    /// Number of octaves that a grid of that spacing has.
    [[nodiscard]] std::size_t count_at(double spacing_m) const;

    SurfaceDomain domain_;
    std::vector<Octave> octaves_;
    std::vector<NoiseLattice> lattices_; ///< of each octave
    /// Level at whose vertices each octave is sampled, unless the grid's is coarser. Not falling.
    std::vector<int> levels_;
    SlopeLoss loss_; ///< by lattice spacings
    bool over_maps_;
};

} // namespace obscura::terrain
