// SPDX-License-Identifier: Apache-2.0
// Value of a spectral curve between its points, for tests of integrals.
#pragma once

#include "core/spectral_band.hpp"

#include <cstddef>
#include <vector>

namespace obscura::test {

/// A curve that is linear between its points and constant outside, by another search than the code's.
inline double linear(const std::vector<SpectralPoint>& c, double at_m) {
    if (at_m <= c.front().wavelength_m) return c.front().value;
    for (std::size_t i = 1; i < c.size(); ++i)
        if (at_m <= c[i].wavelength_m)
            return c[i - 1].value + (c[i].value - c[i - 1].value) * (at_m - c[i - 1].wavelength_m) /
                                        (c[i].wavelength_m - c[i - 1].wavelength_m);
    return c.back().value;
}

} // namespace obscura::test
