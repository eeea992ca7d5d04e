// SPDX-License-Identifier: Apache-2.0
#include "models/graph/derivative.hpp"

#include <algorithm>
#include <array>

namespace obscura::models {
namespace {

/// Least divisor where a derivative is infinite.
constexpr double min_divisor = 1e-150;

/// Applies operations to nodes; terms that are 0 throughout have no nodes, so that they hide no infinity.
class Differentiator {
public:
    Differentiator(Graph& graph, const std::map<std::int32_t, NodeId>& rates)
        : graph_(graph), rates_(rates), zero_(graph.constant(0)) {}

    /// Rate of the node, those of its operands being known.
    [[nodiscard]] NodeId rate(NodeId id, const std::array<NodeId, 3>& rates) {
        // A copy: the list of nodes grows.
        const Node node = graph_.node(id);
        if (node.operation == Operation::input) {
            const auto at = rates_.find(node.index);
            return at == rates_.end() ? zero_ : at->second;
        }
        const bool constant = std::all_of(rates.begin(), rates.end(), [&](NodeId r) { return is_zero(r); });
        if (constant) return zero_;
        const auto [a, b, c] = node.operands;
        const auto [da, db, dc] = rates;
        switch (node.operation) {
        case Operation::add:
            return sum(da, db);
        case Operation::subtract:
            return difference(da, db);
        case Operation::multiply:
            return sum(product(da, b), product(a, db));
        case Operation::divide:
            return quotient(difference(da, product(id, db)), b);
        case Operation::minimum:
            return chosen(graph_.apply(Operation::less, a, b), da, db);
        case Operation::maximum:
            return chosen(graph_.apply(Operation::less, b, a), da, db);
        case Operation::power:
            return rate_of_power(id, a, b, da, db);
        case Operation::remainder:
            return difference(da, product(quotient(difference(a, id), b), db));
        case Operation::arc_tangent_2:
            return quotient(difference(product(da, b), product(a, db)),
                            at_least(sum(product(a, a), product(b, b)), min_divisor));
        case Operation::select:
            return chosen(a, db, dc);
        default:
            return rate_of_function(node.operation, id, a, da);
        }
    }

private:
    NodeId rate_of_power(NodeId power, NodeId base, NodeId exponent, NodeId base_rate, NodeId exponent_rate) {
        const NodeId less_one =
            graph_.apply(Operation::power, base, graph_.apply(Operation::subtract, exponent, number(1)));
        return sum(product(base_rate, product(exponent, less_one)),
                   is_zero(exponent_rate)
                       ? zero_
                       : product(exponent_rate, product(power, graph_.apply(Operation::logarithm, base))));
    }

    NodeId rate_of_function(Operation operation, NodeId result, NodeId a, NodeId da) {
        const auto of = [&](Operation op) { return graph_.apply(op, a); };
        const auto root_of_rest = [&] {
            const NodeId rest = graph_.apply(Operation::subtract, number(1), product(a, a));
            return at_least(
                graph_.apply(Operation::square_root, graph_.apply(Operation::maximum, rest, zero_)),
                min_divisor);
        };
        switch (operation) {
        case Operation::negate:
            return negative(da);
        case Operation::absolute:
            return chosen(graph_.apply(Operation::less, a, zero_), negative(da), da);
        case Operation::square_root:
            return quotient(da, at_least(product(number(2), result), min_divisor));
        case Operation::exponential:
            return product(result, da);
        case Operation::logarithm:
            return quotient(da, a);
        case Operation::sine:
            return product(of(Operation::cosine), da);
        case Operation::cosine:
            return negative(product(of(Operation::sine), da));
        case Operation::tangent:
            return product(sum(number(1), product(result, result)), da);
        case Operation::arc_sine:
            return quotient(da, root_of_rest());
        case Operation::arc_cosine:
            return negative(quotient(da, root_of_rest()));
        case Operation::arc_tangent:
            return quotient(da, sum(number(1), product(a, a)));
        default: // steps and conditions
            return zero_;
        }
    }

    [[nodiscard]] bool is_zero(NodeId id) const { return id < 0 || id == zero_; }
    NodeId number(double value) { return graph_.constant(value); }
    NodeId sum(NodeId a, NodeId b) {
        if (is_zero(a)) return b;
        return is_zero(b) ? a : graph_.apply(Operation::add, a, b);
    }
    NodeId difference(NodeId a, NodeId b) {
        if (is_zero(b)) return a;
        return is_zero(a) ? negative(b) : graph_.apply(Operation::subtract, a, b);
    }
    NodeId product(NodeId a, NodeId b) {
        return is_zero(a) || is_zero(b) ? zero_ : graph_.apply(Operation::multiply, a, b);
    }
    NodeId quotient(NodeId a, NodeId b) { return is_zero(a) ? zero_ : graph_.apply(Operation::divide, a, b); }
    NodeId negative(NodeId a) { return is_zero(a) ? zero_ : graph_.apply(Operation::negate, a); }
    NodeId chosen(NodeId when, NodeId a, NodeId b) { return graph_.apply(Operation::select, when, a, b); }
    NodeId at_least(NodeId a, double least) { return graph_.apply(Operation::maximum, a, number(least)); }

    Graph& graph_;
    const std::map<std::int32_t, NodeId>& rates_;
    NodeId zero_;
};

constexpr std::size_t place(NodeId id) {
    return static_cast<std::size_t>(id);
}

} // namespace

std::vector<NodeId> derivatives(Graph& graph, std::span<const NodeId> nodes,
                                const std::map<std::int32_t, NodeId>& rates) {
    const std::vector<bool> needed = needed_nodes(graph, nodes);
    Differentiator differentiator(graph, rates);
    std::vector<NodeId> known(needed.size(), -1);
    for (std::size_t i = 0; i < needed.size(); ++i) {
        if (!needed[i]) continue;
        std::array<NodeId, 3> operand_rates{-1, -1, -1};
        for (std::size_t k = 0; k < operand_rates.size(); ++k) {
            const NodeId operand = graph.nodes()[i].operands[k];
            if (operand >= 0) operand_rates[k] = known[place(operand)];
        }
        known[i] = differentiator.rate(static_cast<NodeId>(i), operand_rates);
    }
    std::vector<NodeId> results;
    for (const NodeId id : nodes)
        results.push_back(known[place(id)]);
    return results;
}

std::vector<NodeId> inserted(Graph& into, const Graph& from, std::span<const NodeId> nodes,
                             std::span<const NodeId> inputs) {
    const std::vector<bool> needed = needed_nodes(from, nodes);
    std::vector<NodeId> copies(needed.size(), -1);
    for (std::size_t i = 0; i < needed.size(); ++i) {
        if (!needed[i]) continue;
        const Node& node = from.nodes()[i];
        const auto copy = [&](std::size_t k) {
            return node.operands[k] >= 0 ? copies[place(node.operands[k])] : -1;
        };
        if (node.operation == Operation::constant)
            copies[i] = into.constant(node.value);
        else if (node.operation == Operation::uniform)
            copies[i] = into.uniform(node.index);
        else if (node.operation == Operation::input)
            copies[i] = inputs[static_cast<std::size_t>(node.index)];
        else
            copies[i] = into.apply(node.operation, copy(0), copy(1), copy(2));
    }
    std::vector<NodeId> results;
    for (const NodeId id : nodes)
        results.push_back(copies[place(id)]);
    return results;
}

} // namespace obscura::models
