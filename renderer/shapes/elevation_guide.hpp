// SPDX-License-Identifier: Apache-2.0
// Elevation guide: density of the elevations of bounce rays, after how often they meet their own body again.
#pragma once

#include "renderer/shapes/shape.hpp"

#include <array>
#include <cstddef>

namespace obscura::renderer {

/// Path guiding for bodies that are nearly convex: from the ground of a moon only the lowest few degrees of
/// the sky hold more ground, and cosine-weighted rays seldom go there. Half of the rays are cosine-weighted,
/// the other half have a pdf proportional to the cosine times the root of the share of rays of an
/// elevation that meet the body again: the least variance where what they meet is equally bright (Rath et
/// al., Variance-aware path guiding, ACM Trans. Graph. 39(4), 2020).
///
/// Elevations are given as the squared cosine of the angle to the normal, of which cosine-weighted directions
/// have density 1 on [0, 1]. Immutable; thread-safe.
class ElevationGuide {
public:
    /// Traces 11,264 rays from the surface, the same ones each time. `alone`: bounce rays can meet no other
    /// body.
    ElevationGuide(const Shape& shape, bool alone);

    /// Whether the guided density differs from the cosine-weighted one.
    [[nodiscard]] bool guides() const { return guides_; }
    /// Samples 16 elevations from uniform numbers `u` in [0, 1): squared cosines of the angle to the normal,
    /// their density (pdf over that of cosine-weighted sampling), and the factor on the throughput in Russian
    /// roulette: as if the ray were not guided, times the chance that it meets anything.
    void sample(const Doubles& u, Doubles& cos2, Doubles& density, Doubles& expectation) const;
    /// Density of sample() at one squared cosine.
    [[nodiscard]] double density(double cos2) const;

private:
    /// Intervals of the squared cosine: [0, 2^-10), [2^-10, 2^-9), ..., [1/2, 1).
    static constexpr std::size_t intervals = 11;

    std::array<double, intervals> first_{}; ///< lower end of each interval
    std::array<double, intervals> density_{};
    std::array<double, intervals> inverse_density_{};
    std::array<double, intervals> expectation_{};
    std::array<double, intervals + 1> cumulated_{}; ///< probability of the intervals before
    bool guides_ = false;
};

} // namespace obscura::renderer
