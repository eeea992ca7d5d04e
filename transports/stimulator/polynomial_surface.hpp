// SPDX-License-Identifier: Apache-2.0
// Polynomial surface through scattered points of a screen.
#pragma once

#include "transports/stimulator/linear_solve.hpp"
#include "transports/stimulator/screen_map.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

namespace obscura::transports {

/// Least-squares polynomial in two variables of total degree 1, 3 or 5 over a box.
class PolynomialSurface {
public:
    PolynomialSurface(double x0, double y0, double x1, double y1)
        : x0_(x0), y0_(y0), sx_(2 / std::max(x1 - x0, 1.0)), sy_(2 / std::max(y1 - y0, 1.0)) {}
    /// Returns false if the points do not determine the polynomial.
    bool fit(const std::vector<PixelPoint>& at, const std::vector<double>& values) {
        if (at.size() >= 60 && fit_degree<21>(at, values)) return true;
        if (at.size() >= 24 && fit_degree<10>(at, values)) return true;
        return at.size() >= 6 && fit_degree<3>(at, values);
    }
    /// Value at `p`; outside of the box the value at its edge, because extrapolation diverges.
    [[nodiscard]] double operator()(PixelPoint p) const {
        const std::array<double, 21> terms = basis(p);
        double sum = 0;
        for (std::size_t i = 0; i < count_; ++i)
            sum += coefficients_[i] * terms[i];
        return sum;
    }

private:
    [[nodiscard]] std::array<double, 21> basis(PixelPoint p) const {
        const double x = std::clamp((p.x - x0_) * sx_ - 1, -1.0, 1.0);
        const double y = std::clamp((p.y - y0_) * sy_ - 1, -1.0, 1.0);
        std::array<double, 21> terms{};
        std::size_t i = 0;
        for (int degree = 0; degree <= 5; ++degree) {
            for (int j = 0; j <= degree; ++j) {
                double term = 1;
                for (int k = 0; k < degree - j; ++k)
                    term *= x;
                for (int k = 0; k < j; ++k)
                    term *= y;
                terms[i++] = term;
            }
        }
        return terms;
    }
    template<std::size_t n>
    bool fit_degree(const std::vector<PixelPoint>& at, const std::vector<double>& values) {
        NormalEquations<n> equations;
        for (std::size_t i = 0; i < at.size(); ++i) {
            const auto all = basis(at[i]);
            std::array<double, n> some{};
            std::copy_n(all.begin(), n, some.begin());
            equations.add(some, values[i]);
        }
        std::array<double, n> solution{};
        if (!equations.solve(solution)) return false;
        std::copy(solution.begin(), solution.end(), coefficients_.begin());
        count_ = n;
        return true;
    }
    double x0_, y0_, sx_, sy_;
    std::array<double, 21> coefficients_{};
    std::size_t count_ = 0;
};

} // namespace obscura::transports
