// SPDX-License-Identifier: Apache-2.0
// Random features on a surface, Poisson distributed by true area: found near a place, in no stored list.
#pragma once

#include "terrain/height_layer.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace obscura::terrain {

/// Features of sizes 2^exponent to 2^(exponent + 1) m.
struct FeatureOctave {
    int exponent = 0;
    double per_m2 = 0;  ///< mean number
    double reach_m = 0; ///< largest distance (chord) at which one has effect
};

struct Feature {
    std::uint64_t id = 0;     ///< unique among the features of a FeatureField
    std::uint32_t octave = 0; ///< index
    Vec3 position_m;          ///< of the reference surface
    std::array<std::uint32_t, 4> random{};
};

/// Each octave has a grid of square cells of 8 to 16 sizes on every face. A cell's features follow from a
/// hash of its number: their count has a Poisson distribution; places are uniform by area, by thinning.
/// Immutable; thread-safe.
class FeatureField {
public:
    /// `stream`: another one has other features for the same seed. Octaves rise by 1 in exponent.
    FeatureField(const SurfaceDomain& domain, std::uint64_t seed, std::uint32_t stream,
                 std::vector<FeatureOctave> octaves);

    [[nodiscard]] const SurfaceDomain& domain() const { return domain_; }
    [[nodiscard]] const std::vector<FeatureOctave>& octaves() const { return octaves_; }

    /// Appends the features of octaves `first` to before `last` that are within radius + reach of the cap's
    /// centre: all that may have effect in the cap. `reach_share`: of the octaves' reach.
    void near(const Cap& cap, std::size_t first, std::size_t last, std::vector<Feature>& features,
              double reach_share = 1) const;

    /// Calls `use(feature)` with the features of octaves `first` to before `last`, the largest first, in the
    /// squares that are wanted with all that they are in: `wants(square, octave, finer)`, where features are
    /// in squares `finer` levels below. Takes no memory.
    template<typename Wants, typename Use>
    void visit(std::size_t first, std::size_t last, const Wants& wants, const Use& use) const {
        for (std::size_t octave = std::min(last, octaves_.size()); octave-- > first;) {
            if (!(octaves_[octave].per_m2 > 0)) continue;
            for (std::uint8_t face = 0; face < domain_.faces(); ++face)
                visit_square({face, 0, 0, 0}, octave, wants, use);
        }
    }
    /// Calls `use(feature)` with what near() finds. Takes no memory.
    template<typename Use>
    void visit_near(const Cap& cap, std::size_t first, std::size_t last, double reach_share,
                    const Use& use) const {
        for (std::size_t octave = first; octave < std::min(last, octaves_.size()); ++octave)
            for (std::uint8_t face = 0; face < domain_.faces(); ++face) {
                const Cells cells = cells_near(octave, face, cap, reach_share);
                const double reach_m = cap.radius_m + reach_share * octaves_[octave].reach_m;
                for (std::uint32_t j = cells.j0; j < cells.j1; ++j)
                    for (std::uint32_t i = cells.i0; i < cells.i1; ++i) {
                        Cell cell(*this, octave, {face, static_cast<std::uint8_t>(levels_[octave]), i, j});
                        while (cell.next())
                            if (length_squared(cell.position_m() - cap.centre_m) <= reach_m * reach_m)
                                use(cell.feature());
                    }
            }
    }
    /// The feature of that identity; there must be one.
    [[nodiscard]] Feature feature(std::uint64_t id) const;

private:
    /// Features of a cell of an octave, one after another.
    class Cell {
    public:
        Cell(const FeatureField& field, std::size_t octave, TileKey cell);
        /// Goes on to the next feature; false: there is none.
        [[nodiscard]] bool next();
        /// Goes to the feature of a number.
        void go_to(std::uint32_t number);
        [[nodiscard]] Vec3 position_m() const { return position_m_; }
        [[nodiscard]] Feature feature() const;

    private:
        [[nodiscard]] std::array<std::uint32_t, 4> words(std::uint32_t number) const;
        /// Whether the cell has a feature of the present number, whose place is found.
        [[nodiscard]] bool place();

        const FeatureField& field_;
        std::size_t octave_;
        TileKey cell_;
        double width_, u0_, v0_, most_;
        std::uint32_t count_ = 0, number_ = 0;
        Vec3 position_m_;
    };
    /// Cells i0 to before i1 and j0 to before j1 of a face.
    struct Cells {
        std::uint32_t i0 = 0, i1 = 0, j0 = 0, j1 = 0;
    };
    /// Cells that have a part of a cap with the share of an octave's reach around it.
    [[nodiscard]] Cells cells_near(std::size_t octave, std::uint8_t face, const Cap& cap,
                                   double reach_share) const;

    template<typename Wants, typename Use>
    void visit_square(TileKey square, std::size_t octave, const Wants& wants, const Use& use) const {
        const int finer = levels_[octave] - square.level;
        if (!wants(square, octave, finer)) return;
        if (finer > 0) {
            for (unsigned quarter = 0; quarter < 4; ++quarter)
                visit_square(square.child(quarter), octave, wants, use);
        } else {
            Cell cell(*this, octave, square);
            while (cell.next())
                use(cell.feature());
        }
    }
    [[nodiscard]] double area_m2(std::uint8_t face, double u, double v) const;

    SurfaceDomain domain_;
    std::uint64_t seed_;
    std::uint32_t stream_;
    std::vector<FeatureOctave> octaves_;
    std::vector<int> levels_; ///< of the grid of each octave: 2^level cells along a face
    double max_area_m2_;      ///< of a step of 1 in u and in v, times the gnomonic factor
};

} // namespace obscura::terrain
