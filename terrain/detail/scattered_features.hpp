// SPDX-License-Identifier: Apache-2.0
// Random features on a surface, Poisson distributed by true area: found near a place, in no stored list.
#pragma once

#include "terrain/height_layer.hpp"

#include <array>
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

    [[nodiscard]] const std::vector<FeatureOctave>& octaves() const { return octaves_; }

    /// Appends the features of octaves `first` to before `last` that are within radius + reach of the cap's
    /// centre: all that may have effect in the cap. `reach_share`: of the octaves' reach.
    void near(const Cap& cap, std::size_t first, std::size_t last, std::vector<Feature>& features,
              double reach_share = 1) const;

private:
    [[nodiscard]] double area_m2(std::uint8_t face, double u, double v) const;

    SurfaceDomain domain_;
    std::uint64_t seed_;
    std::uint32_t stream_;
    std::vector<FeatureOctave> octaves_;
    std::vector<int> levels_; ///< of the grid of each octave: 2^level cells along a face
    double most_area_m2_;     ///< of a step of 1 in u and in v, times the gnomonic factor
};

} // namespace obscura::terrain
