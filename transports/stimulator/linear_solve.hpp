// SPDX-License-Identifier: Apache-2.0
// Normal equations of a linear least-squares fit, solved by Cholesky decomposition.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace obscura::transports {

/// Normal equations A x = b of a least-squares fit with N unknowns, accumulated one observation at a time and
/// solved by Cholesky decomposition. N is small (a polynomial, a homography), the observations are many.
template<std::size_t N>
class NormalEquations {
public:
    /// Adds the observation coefficients . x = value.
    void add(const std::array<double, N>& coefficients, double value, double weight = 1) {
        for (std::size_t i = 0; i < N; ++i) {
            for (std::size_t j = 0; j <= i; ++j)
                a_[i][j] += weight * coefficients[i] * coefficients[j];
            b_[i] += weight * coefficients[i] * value;
        }
    }
    /// Solves for `x`; returns false if the observations do not determine the unknowns.
    [[nodiscard]] bool solve(std::array<double, N>& x) const {
        std::array<std::array<double, N>, N> l{};
        for (std::size_t i = 0; i < N; ++i) {
            for (std::size_t j = 0; j <= i; ++j) {
                double sum = a_[i][j];
                for (std::size_t k = 0; k < j; ++k)
                    sum -= l[i][k] * l[j][k];
                if (i == j) {
                    if (!(sum > 1e-13 * std::max(a_[i][i], 1e-300))) return false;
                    l[i][i] = std::sqrt(sum);
                } else {
                    l[i][j] = sum / l[j][j];
                }
            }
        }
        std::array<double, N> y{};
        for (std::size_t i = 0; i < N; ++i) {
            double sum = b_[i];
            for (std::size_t k = 0; k < i; ++k)
                sum -= l[i][k] * y[k];
            y[i] = sum / l[i][i];
        }
        for (std::size_t i = N; i-- > 0;) {
            double sum = y[i];
            for (std::size_t k = i + 1; k < N; ++k)
                sum -= l[k][i] * x[k];
            x[i] = sum / l[i][i];
        }
        return true;
    }

private:
    std::array<std::array<double, N>, N> a_{};
    std::array<double, N> b_{};
};

} // namespace obscura::transports
