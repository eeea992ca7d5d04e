// SPDX-License-Identifier: Apache-2.0
// How many craters of which size and age a lunar surface has, and their shapes.
#pragma once

#include <cstddef>
#include <vector>

namespace obscura::terrain {

/// Cumulative number N(>D) of craters: the smaller of production at the surface's age (Neukum, Ivanov,
/// Hartmann, Cratering records in the inner solar system, Space Sci. Rev. 96, 2001; for D below 10 m its
/// power law there goes on) and of equilibrium (Trask 1966: 10^-1.1 D^-2 per m2, D in m). Where there is
/// equilibrium, the youngest craters remain. Rates and sizes are the Moon's. Immutable; thread-safe.
class CraterLaw {
public:
    static constexpr double largest_diameter_m = 300e3;

    /// `age_ga`: of the surface, above 0 and not above 4.5.
    explicit CraterLaw(double age_ga);

    /// N(1 km) per km2 of a surface of an age, and the age of that N; Ga.
    [[nodiscard]] static double chronology(double age_ga);
    [[nodiscard]] double age_of(double chronology) const;
    /// N(>D) per m2 after the surface's age.
    [[nodiscard]] double production_per_m2(double diameter_m) const;
    [[nodiscard]] static double equilibrium_per_m2(double diameter_m);
    [[nodiscard]] double per_m2(double diameter_m) const;
    /// Age of the oldest craters of a diameter, as N(1 km).
    [[nodiscard]] double oldest(double diameter_m) const;

private:
    double age_ga_, chronology_;
    std::vector<double> table_; ///< chronology at even steps of the age
};

/// Depth of fresh craters, m: simple ones above 400 m and complex ones (Pike, Impact and Explosion Cratering,
/// 1977), below by LRO images (Stopar et al. 2017).
[[nodiscard]] double crater_depth_m(double diameter_m);
[[nodiscard]] double crater_rim_m(double diameter_m);
/// m2/Ma (Fassett, Thomson, Crater degradation on the lunar maria, JGR 119, 2014; sizes below after
/// NASA's synthterrain).
[[nodiscard]] double crater_diffusivity(double diameter_m);

/// Profiles of craters of about one diameter, from fresh to worn: heights over diameters against the squared
/// distance from the centre over the squared radius. Fresh: Fassett and Thomson, equation 4, with the floor
/// at the depth; worn by diffusion. Immutable.
class CraterProfiles {
public:
    static constexpr double reach = 2.5; ///< in radii; 0 beyond
    static constexpr double reach_squared = reach * reach;
    static constexpr std::size_t steps = 200; ///< of the squared distance

    /// Up to `max_wear`: kappa t / radius^2, but not further than the wear at which a crater is gone.
    CraterProfiles(double diameter_m, double max_wear);

    /// The profile at a wear: steps + 2 values, the last two 0. Returns the number of steps beyond which it
    /// is 0.
    std::size_t at(double wear, double* values) const;
    /// Largest rim and smallest floor of all, over diameters.
    [[nodiscard]] double least() const { return least_; }
    [[nodiscard]] double largest() const { return largest_; }

private:
    double max_wear_ = 0, least_ = 0, largest_ = 0;
    /// At wears that are even in the square root.
    std::vector<std::vector<double>> rows_;
    std::vector<std::size_t> extents_; ///< of each row: steps beyond which it is nothing
};

} // namespace obscura::terrain
