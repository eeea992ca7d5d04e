// SPDX-License-Identifier: Apache-2.0
#include "models/graph/slope_bounds.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace obscura::models {
namespace {

constexpr std::array<std::array<std::size_t, 2>, 6> second_axes{
    {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};

bool is_flat(const SlopeBounds& a) {
    return a.gradient[0].is_zero() && a.gradient[1].is_zero() && a.gradient[2].is_zero() && !a.bends_up &&
           !a.bends_down;
}

/// Bends of something that is multiplied by `factor`.
void add_bends(SlopeBounds& out, const SlopeBounds& a, Interval factor) {
    if (factor.hi > 0) {
        out.bends_up |= a.bends_up;
        out.bends_down |= a.bends_down;
    }
    if (factor.lo < 0) {
        out.bends_up |= a.bends_down;
        out.bends_down |= a.bends_up;
    }
}

/// A function of one argument, by its own derivatives.
SlopeBounds chained(const SlopeBounds& a, Interval value, Interval first, Interval second) {
    SlopeBounds out;
    out.value = value;
    for (std::size_t k = 0; k < 3; ++k)
        out.gradient[k] = first * a.gradient[k];
    for (std::size_t k = 0; k < 6; ++k) {
        const auto [i, j] = second_axes[k];
        const Interval steep = i == j ? square(a.gradient[i]) : a.gradient[i] * a.gradient[j];
        out.second[k] = second * (steep.is_zero() ? Interval{} : steep) + first * a.second[k];
    }
    add_bends(out, a, first);
    return out;
}

SlopeBounds sum_of(const SlopeBounds& a, const SlopeBounds& b, double sign) {
    const auto plus = [&](Interval x, Interval y) { return y.is_zero() ? x : sign > 0 ? x + y : x - y; };
    SlopeBounds out;
    out.value = plus(a.value, b.value);
    for (std::size_t k = 0; k < 3; ++k)
        out.gradient[k] = plus(a.gradient[k], b.gradient[k]);
    for (std::size_t k = 0; k < 6; ++k)
        out.second[k] = plus(a.second[k], b.second[k]);
    add_bends(out, a, Interval::at(1));
    add_bends(out, b, Interval::at(sign));
    return out;
}

SlopeBounds product_of(const SlopeBounds& a, const SlopeBounds& b) {
    SlopeBounds out;
    out.value = a.value * b.value;
    for (std::size_t k = 0; k < 3; ++k)
        out.gradient[k] = a.value * b.gradient[k] + b.value * a.gradient[k];
    for (std::size_t k = 0; k < 6; ++k) {
        const auto [i, j] = second_axes[k];
        out.second[k] = a.value * b.second[k] + b.value * a.second[k] + a.gradient[i] * b.gradient[j] +
                        a.gradient[j] * b.gradient[i];
    }
    add_bends(out, a, b.value);
    add_bends(out, b, a.value);
    return out;
}

/// 1 / a.
SlopeBounds inverse(const SlopeBounds& a) {
    const Interval q = Interval::at(1) / a.value;
    const Interval q2 = a.value.has(0) ? Interval::whole() : square(q);
    return chained(a, q, -q2, Interval::at(2) * q2 * q);
}

SlopeBounds of_either(Interval value, const SlopeBounds& a, const SlopeBounds& b, bool up, bool down) {
    SlopeBounds out;
    out.value = value;
    for (std::size_t k = 0; k < 3; ++k)
        out.gradient[k] = hull(a.gradient[k], b.gradient[k]);
    for (std::size_t k = 0; k < 6; ++k)
        out.second[k] = hull(a.second[k], b.second[k]);
    out.bends_up = up || a.bends_up || b.bends_up;
    out.bends_down = down || a.bends_down || b.bends_down;
    return out;
}

SlopeBounds of_angle(Interval value, const SlopeBounds& y, const SlopeBounds& x) {
    const Interval s = square(x.value) + square(y.value);
    SlopeBounds out;
    out.value = value;
    std::array<Interval, 3> turn;
    for (std::size_t k = 0; k < 3; ++k) {
        turn[k] = y.gradient[k] * x.value - y.value * x.gradient[k];
        out.gradient[k] = turn[k] / s;
    }
    const auto of_s = [&](std::size_t j) {
        return Interval::at(2) * (x.value * x.gradient[j] + y.value * y.gradient[j]);
    };
    for (std::size_t k = 0; k < 6; ++k) {
        const auto [i, j] = second_axes[k];
        const Interval turns = y.second[k] * x.value + y.gradient[i] * x.gradient[j] -
                               y.gradient[j] * x.gradient[i] - y.value * x.second[k];
        out.second[k] = turns / s - turn[i] * of_s(j) / square(s);
    }
    const bool cut = x.value.lo <= 0 && y.value.has(0);
    const bool bends = y.bends_up || y.bends_down || x.bends_up || x.bends_down || cut;
    out.bends_up = out.bends_down = bends;
    return out;
}

SlopeBounds of_power(const SlopeBounds& a, const SlopeBounds& b) {
    if (is_flat(b) && b.value.is_one_number()) {
        const double n = b.value.lo;
        const auto power = [&](double e) {
            return interval_of(Operation::power, a.value, Interval::at(e), {});
        };
        const Interval first = n == 0 ? Interval{} : Interval::at(n) * power(n - 1);
        const Interval second = n == 0 || n == 1 ? Interval{} : Interval::at(n * (n - 1)) * power(n - 2);
        return chained(a, power(n), first, second);
    }
    // e^(b ln a)
    const Interval log_value = interval_of(Operation::logarithm, a.value, {}, {});
    const Interval once = Interval::at(1) / a.value;
    const SlopeBounds exponent =
        product_of(b, chained(a, log_value, once, a.value.has(0) ? Interval::whole() : -square(once)));
    const Interval value = interval_of(Operation::power, a.value, b.value, {});
    return chained(exponent, value, value, value);
}

/// C's fmod: jumps where the quotient is a whole number.
SlopeBounds of_remainder(const SlopeBounds& a, const SlopeBounds& b) {
    const Interval quotient = a.value / b.value;
    const Interval whole{std::trunc(quotient.lo), std::trunc(quotient.hi)};
    SlopeBounds turns;
    turns.value = whole;
    SlopeBounds out = sum_of(a, product_of(turns, b), -1);
    out.value = interval_of(Operation::remainder, a.value, b.value, {});
    if (!(whole.lo == whole.hi)) out.bends_up = out.bends_down = true;
    return out;
}

} // namespace

double SlopeBounds::max_slope() const noexcept {
    return std::sqrt(gradient[0].magnitude() * gradient[0].magnitude() +
                     gradient[1].magnitude() * gradient[1].magnitude() +
                     gradient[2].magnitude() * gradient[2].magnitude());
}

double SlopeBounds::max_bend() const noexcept {
    std::array<double, 6> m{};
    for (std::size_t k = 0; k < 6; ++k)
        m[k] = second[k].magnitude();
    // Rows of the matrix; the eigenvalues are no larger than the largest row sum, or than its norm.
    const double rows = std::max({m[0] + m[3] + m[4], m[1] + m[3] + m[5], m[2] + m[4] + m[5]});
    const double norm =
        std::sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2] + 2 * (m[3] * m[3] + m[4] * m[4] + m[5] * m[5]));
    return std::min(rows, norm);
}

SlopeBounder::SlopeBounder(const Graph& graph, NodeId output, std::span<const double> uniforms)
    : graph_(graph), output_(output), uniforms_(uniforms.begin(), uniforms.end()) {
    const std::array outputs{output};
    const std::vector<bool> needed = needed_nodes(graph, outputs);
    known_.resize(needed.size());
    squares_.resize(needed.size());
    varies_.resize(needed.size());
    for (std::size_t i = 0; i < needed.size(); ++i) {
        if (!needed[i]) continue;
        order_.push_back(i);
        const Node& node = graph.nodes()[i];
        varies_[i] = node.operation == Operation::input ||
                     std::any_of(node.operands.begin(), node.operands.end(),
                                 [&](NodeId id) { return id >= 0 && varies_[static_cast<std::size_t>(id)]; });
        if (node.operation != Operation::square_root) continue;
        std::vector<NodeId> squared;
        if (find_squares(node.operands[0], squared)) squares_[i] = std::move(squared);
    }
}

bool SlopeBounder::find_squares(NodeId id, std::vector<NodeId>& squared) const {
    const Node& node = graph_.node(id);
    if (node.operation == Operation::add)
        return find_squares(node.operands[0], squared) && find_squares(node.operands[1], squared);
    if (node.operation != Operation::multiply || node.operands[0] != node.operands[1]) return false;
    squared.push_back(node.operands[0]);
    return true;
}

const SlopeBounds& SlopeBounder::over(const std::array<Interval, 3>& box) {
    for (const std::size_t i : order_)
        known_[i] = bounds_of(i, box);
    return at(output_);
}

SlopeBounds SlopeBounder::of_root(const Node& node, const SlopeBounds& a) const {
    const Interval root = interval_of(Operation::square_root, a.value, {}, {});
    const Interval first = Interval::at(0.5) / root;
    const Interval second =
        root.has(0) ? Interval{-Interval::whole().hi, 0} : -first * (Interval::at(0.5) / a.value);
    SlopeBounds out = chained(a, root, first, second);
    const auto& squared = squares_[static_cast<std::size_t>(&node - graph_.nodes().data())];
    if (squared.empty()) return out;
    // The root of a sum of squares is a length: each square is no larger than it, even at 0.
    std::array<Interval, 3> gradient{};
    for (const NodeId id : squared) {
        const SlopeBounds& u = at(id);
        const Interval share = common(u.value / root, {-1, 1});
        for (std::size_t k = 0; k < 3; ++k)
            gradient[k] = gradient[k] + share * u.gradient[k];
    }
    for (std::size_t k = 0; k < 3; ++k)
        out.gradient[k] = common(gradient[k], out.gradient[k]);
    return out;
}

SlopeBounds SlopeBounder::of_function(const Node& node, const SlopeBounds& a) const {
    const Interval v = interval_of(node.operation, a.value, {}, {});
    const Interval x = a.value;
    const auto rest = [&] { // 1 - x^2
        return common({0, 1}, Interval::at(1) - square(x));
    };
    const auto value_of = [&](Operation op) { return interval_of(op, x, {}, {}); };
    switch (node.operation) {
    case Operation::negate:
        return chained(a, v, Interval::at(-1), {});
    case Operation::absolute:
        if (x.lo >= 0) return a;
        if (x.hi <= 0) return chained(a, v, Interval::at(-1), {});
        return of_either(v, a, chained(a, v, Interval::at(-1), {}), true, false);
    case Operation::square_root:
        return of_root(node, a);
    case Operation::exponential:
        return chained(a, v, v, v);
    case Operation::logarithm: {
        const Interval first = Interval::at(1) / x;
        return chained(a, v, first, x.has(0) ? Interval::whole() : -square(first));
    }
    case Operation::sine:
        return chained(a, v, value_of(Operation::cosine), -v);
    case Operation::cosine:
        return chained(a, v, -value_of(Operation::sine), -v);
    case Operation::tangent: {
        const Interval first = Interval::at(1) + square(v);
        return chained(a, v, first, Interval::at(2) * v * first);
    }
    case Operation::arc_sine:
    case Operation::arc_cosine: {
        const Interval root = interval_of(Operation::square_root, rest(), {}, {});
        const Interval first = Interval::at(node.operation == Operation::arc_sine ? 1 : -1) / root;
        return chained(a, v, first, first * x / rest());
    }
    case Operation::arc_tangent: {
        const Interval first = Interval::at(1) / (Interval::at(1) + square(x));
        return chained(a, v, first, Interval::at(-2) * x * square(first));
    }
    default: { // steps and conditions
        SlopeBounds out;
        out.value = v;
        out.bends_up = out.bends_down = !v.is_one_number();
        return out;
    }
    }
}

SlopeBounds SlopeBounder::bounds_of(std::size_t i, const std::array<Interval, 3>& box) const {
    const Node& node = graph_.nodes()[i];
    static const SlopeBounds none;
    const auto operand = [&](std::size_t k) -> const SlopeBounds& {
        return node.operands[k] >= 0 ? at(node.operands[k]) : none;
    };
    const SlopeBounds &a = operand(0), &b = operand(1);
    SlopeBounds out;
    switch (node.operation) {
    case Operation::constant:
        out.value = Interval::at(node.value);
        return out;
    case Operation::uniform:
        out.value = Interval::at(uniforms_[static_cast<std::size_t>(node.index)]);
        return out;
    case Operation::input:
        out.value = box[static_cast<std::size_t>(node.index)];
        out.gradient[static_cast<std::size_t>(node.index)] = Interval::at(1);
        return out;
    default:
        break;
    }
    if (!varies_[i]) { // as the program computes it
        const double value = result_of(node.operation, a.value.lo, b.value.lo, operand(2).value.lo);
        out.value = std::isnan(value) ? Interval::whole() : Interval::at(value);
        return out;
    }
    const Interval v = interval_of(node.operation, a.value, b.value, operand(2).value);
    switch (node.operation) {
    case Operation::add:
        return sum_of(a, b, 1);
    case Operation::subtract:
        return sum_of(a, b, -1);
    case Operation::multiply:
        if (node.operands[0] == node.operands[1])
            return chained(a, square(a.value), Interval::at(2) * a.value, Interval::at(2));
        return product_of(a, b);
    case Operation::divide:
        return product_of(a, inverse(b));
    case Operation::minimum:
        if (a.value.hi <= b.value.lo) return a;
        return b.value.hi <= a.value.lo ? b : of_either(v, a, b, false, true);
    case Operation::maximum:
        if (a.value.lo >= b.value.hi) return a;
        return b.value.lo >= a.value.hi ? b : of_either(v, a, b, true, false);
    case Operation::power:
        return of_power(a, b);
    case Operation::remainder:
        return of_remainder(a, b);
    case Operation::arc_tangent_2:
        return of_angle(v, a, b);
    case Operation::less:
    case Operation::less_or_equal:
    case Operation::equal:
    case Operation::both:
    case Operation::either:
        out.value = v;
        return out;
    case Operation::select:
        if (!a.value.has(0)) return b;
        if (a.value.is_zero()) return operand(2);
        return of_either(v, b, operand(2), true, true);
    default:
        return of_function(node, a);
    }
}

} // namespace obscura::models
