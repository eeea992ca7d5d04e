// SPDX-License-Identifier: Apache-2.0
// Polynomials of SPICE kernels: Chebyshev series, Lagrange and Hermite interpolation, difference lines.
#pragma once

#include "ephemeris/time/epoch.hpp"

#include <cstddef>
#include <span>

namespace obscura::ephemeris {

/// Value of a function and its derivative.
struct ValueAndRate {
    double value = 0, rate = 0;
};

/// Sum of c[k] T_k(x) and its derivative by x; |x| <= 1. Clenshaw's recurrence.
[[nodiscard]] ValueAndRate chebyshev(std::span<const double> c, double x) noexcept;

/// Integral of the series from 0 to x, of at most max_integrated coefficients.
inline constexpr std::size_t max_integrated = 64;
[[nodiscard]] double chebyshev_integral(std::span<const double> c, double x) noexcept;

/// Largest number of samples in an interpolation, as in SPICE.
constexpr std::size_t max_samples = 28;

/// Lagrange interpolation at 0 of `values` at `x` (equal sizes, at most max_samples, x distinct), by
/// Neville's scheme.
[[nodiscard]] ValueAndRate lagrange(std::span<const double> x, std::span<const double> values) noexcept;
/// Hermite interpolation at 0: as lagrange(), and the derivatives are met too.
[[nodiscard]] ValueAndRate hermite(std::span<const double> x, std::span<const double> values,
                                   std::span<const double> rates) noexcept;

/// Largest order of a difference line.
constexpr std::size_t max_differences = 25;
/// Modified divided difference array of SPK types 1 and 21: `record` has 4 n + 11 values for differences of
/// up to `n` orders. Sets position and velocity; false: the record is damaged. Source: F. T. Krogh's variable
/// order Adams integrator as in NAIF's SPK Required Reading, "Type 1".
[[nodiscard]] bool difference_line(std::span<const double> record, std::size_t n, TdbTime time,
                                   ValueAndRate (&out)[3]) noexcept;

/// `time` since `epoch_s`, with the precision of the smaller.
[[nodiscard]] inline double since(TdbTime time, double epoch_s) noexcept {
    return (time.whole_s - epoch_s) + time.part_s;
}

} // namespace obscura::ephemeris
