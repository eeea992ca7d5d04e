// SPDX-License-Identifier: Apache-2.0
// Roughness of a terrain as rms slope against baseline, and the octaves of noise that have it.
#pragma once

#include "core/text/enum_names.hpp"

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace obscura::terrain {

/// Terrains with a table of their own.
enum class TerrainClass : std::uint8_t { highlands, maria, mars, rubble_pile };
constexpr auto enum_names(TerrainClass /*type*/) {
    using C = TerrainClass;
    return std::array{EnumName{C::highlands, "highlands"}, EnumName{C::maria, "maria"},
                      EnumName{C::mars, "mars"}, EnumName{C::rubble_pile, "rubble_pile"}};
}

/// Rms slope over a baseline: atan(nu / L), where nu is the rms difference of heights at distance L.
struct BaselineSlope {
    double baseline_m = 0, slope_rad = 0;
};

/// Between the entries log nu is linear in log L; below the shortest baseline it goes on as between the
/// shortest two. Baselines rise; slopes are above 0 and below 60 degrees.
class SlopeTable {
public:
    explicit SlopeTable(std::span<const BaselineSlope> entries);
    /// Moon: LOLA (LDEM_4 from 7.6 km, 10 m grids of the south pole below), Rosenburg et al., Global surface
    /// slopes and roughness of the Moon, JGR 116, E02001 (2011); Mars and rubble piles (Itokawa, Bennu) are
    /// rounded from published slopes. Below 10 m all are estimates.
    [[nodiscard]] static SlopeTable of_class(TerrainClass terrain);
    /// One slope and a Hurst exponent: nu goes as L^hurst, up to `max_m`.
    [[nodiscard]] static SlopeTable of_hurst(BaselineSlope at, double hurst, double max_m);

    /// Rms difference of heights at distance `baseline_m`, m.
    [[nodiscard]] double deviation_m(double baseline_m) const;
    [[nodiscard]] double max_m() const;

private:
    struct Entry {
        double log2_baseline, log2_deviation;
    };
    std::vector<Entry> entries_; ///< at least two
};

/// Octave of noise: gradient noise (gradient_noise.hpp) of lattice spacing 2^exponent m.
struct Octave {
    int exponent = 0;
    double rms_m = 0;
};

/// Octaves of 2^shortest to 2^longest m, longest first, whose sum has the table's deviation at each baseline
/// 2^n m of that range up to the table's longest, less what others make: `made_m2(L)` is the mean square
/// difference of heights at distance L that the surface has without noise. Least squares of the logarithm of
/// nu^2, with amplitudes not below 0.
[[nodiscard]] std::vector<Octave> solve_octaves(const SlopeTable& table, int shortest, int longest,
                                                const std::function<double(double)>& made_m2);

} // namespace obscura::terrain
