// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/segments/interpolation.hpp"

#include <algorithm>
#include <array>

namespace obscura::ephemeris {
namespace {

/// Neville's scheme at 0 over nodes of which neighbours may be equal: there the first column has the value
/// and its derivative instead. `p` holds value and derivative of each node's polynomial.
ValueAndRate neville(std::span<const double> nodes, std::span<ValueAndRate> p,
                     std::span<const ValueAndRate> double_nodes) noexcept {
    for (std::size_t column = 1; column < nodes.size(); ++column) {
        for (std::size_t i = 0; i + column < nodes.size(); ++i) {
            const double a = nodes[i], b = nodes[i + column];
            if (a == b) {
                // Taylor polynomial about a double node.
                const ValueAndRate& node = double_nodes[i];
                p[i] = {node.value - node.rate * a, node.rate};
                continue;
            }
            const ValueAndRate low = p[i], high = p[i + 1];
            p[i].rate = (b * low.rate - low.value - a * high.rate + high.value) / (b - a);
            p[i].value = (b * low.value - a * high.value) / (b - a);
        }
    }
    return p[0];
}

} // namespace

ValueAndRate chebyshev(std::span<const double> c, double x) noexcept {
    // b: series; d: derivative of the recurrence.
    double b1 = 0, b2 = 0, d1 = 0, d2 = 0;
    for (std::size_t k = c.size(); k-- > 1;) {
        const double d0 = 2 * b1 + 2 * x * d1 - d2;
        const double b0 = c[k] + 2 * x * b1 - b2;
        d2 = d1;
        d1 = d0;
        b2 = b1;
        b1 = b0;
    }
    return {c[0] + x * b1 - b2, b1 + x * d1 - d2};
}

double chebyshev_integral(std::span<const double> c, double x) noexcept {
    // The integral of T_k is (T_{k+1} / (k + 1) - T_{k-1} / (k - 1)) / 2 for k > 1, x for T_0, x^2 / 2 for
    // T_1.
    std::array<double, max_integrated + 1> t{1, x};
    const std::size_t n = std::min(c.size(), max_integrated);
    for (std::size_t k = 2; k <= n; ++k)
        t[k] = 2 * x * t[k - 1] - t[k - 2];
    // T_k at 0: 1, 0, -1, 0 and so on.
    const auto at_zero = [](std::size_t k) { return k % 2 == 1 ? 0.0 : k % 4 == 0 ? 1.0 : -1.0; };
    double sum = 0;
    for (std::size_t k = n; k-- > 2;) {
        const auto order = static_cast<double>(k);
        sum += c[k] / 2 *
               ((t[k + 1] - at_zero(k + 1)) / (order + 1) - (t[k - 1] - at_zero(k - 1)) / (order - 1));
    }
    if (n > 1) sum += c[1] * x * x / 2;
    return n > 0 ? sum + c[0] * x : 0;
}

ValueAndRate lagrange(std::span<const double> x, std::span<const double> values) noexcept {
    std::array<ValueAndRate, max_samples> p;
    for (std::size_t i = 0; i < x.size(); ++i)
        p[i] = {values[i], 0};
    return neville(x, std::span(p).first(x.size()), {});
}

ValueAndRate hermite(std::span<const double> x, std::span<const double> values,
                     std::span<const double> rates) noexcept {
    std::array<double, 2 * max_samples> nodes;
    std::array<ValueAndRate, 2 * max_samples> p, given;
    const std::size_t n = 2 * x.size();
    for (std::size_t i = 0; i < n; ++i) {
        nodes[i] = x[i / 2];
        p[i] = {values[i / 2], 0};
        given[i] = {values[i / 2], rates[i / 2]};
    }
    return neville(std::span(nodes).first(n), std::span(p).first(n), std::span(given).first(n));
}

bool difference_line(std::span<const double> record, std::size_t n, TdbTime time,
                     ValueAndRate (&out)[3]) noexcept {
    // Layout: epoch, n step sizes, (position, velocity) of 3 axes, 3 x n differences, highest order + 1, 3
    // orders.
    const double* const steps = record.data() + 1;
    const double* const reference = steps + n;
    const double* const differences = reference + 6;
    const double* const orders = differences + 3 * n;
    if (!(orders[0] >= 2 && orders[0] <= static_cast<double>(n) + 1)) return false;
    const auto order = static_cast<std::size_t>(orders[0]);
    std::array<std::size_t, 3> terms{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (!(orders[1 + axis] >= 0 && orders[1 + axis] < orders[0])) return false;
        terms[axis] = static_cast<std::size_t>(orders[1 + axis]);
    }

    // Step ratios.
    const double delta = since(time, record[0]);
    std::array<double, max_differences + 2> fc{}, wc{}, w{};
    fc[0] = 1;
    double tp = delta;
    for (std::size_t j = 0; j + 2 < order; ++j) {
        if (steps[j] == 0) return false;
        fc[j + 1] = tp / steps[j];
        wc[j] = delta / steps[j];
        tp = delta + steps[j];
    }
    for (std::size_t j = 0; j < order; ++j)
        w[j] = 1 / static_cast<double>(j + 1);

    // Integration coefficients: reduced from acceleration to velocity to position.
    std::size_t rows = 0, shift = order - 1;
    const auto reduce = [&] {
        for (std::size_t j = 0; j < rows; ++j)
            w[j + shift] = fc[j + 1] * w[j + shift - 1] - wc[j] * w[j + shift];
    };
    while (shift >= 2) {
        ++rows;
        reduce();
        --shift;
    }
    const auto sum = [&](std::size_t axis) {
        double s = 0;
        for (std::size_t j = terms[axis]; j-- > 0;)
            s += differences[axis * n + j] * w[j + shift];
        return s;
    };
    for (std::size_t axis = 0; axis < 3; ++axis)
        out[axis].value = reference[2 * axis] + delta * (reference[2 * axis + 1] + delta * sum(axis));
    reduce();
    --shift;
    for (std::size_t axis = 0; axis < 3; ++axis)
        out[axis].rate = reference[2 * axis + 1] + delta * sum(axis);
    return true;
}

} // namespace obscura::ephemeris
