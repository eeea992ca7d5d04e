// SPDX-License-Identifier: Apache-2.0
#include "models/graph/graph.hpp"

#include <bit>
#include <cmath>
#include <utility>

namespace obscura::models {

NodeId Graph::constant(double value) {
    Node node;
    node.value = value;
    return add(node);
}

NodeId Graph::leaf(Operation operation, std::int32_t index) {
    Node node;
    node.operation = operation;
    node.index = index;
    return add(node);
}

NodeId Graph::add(const Node& node) {
    const std::uint64_t bits = node.operation == Operation::constant
                                   ? std::bit_cast<std::uint64_t>(node.value)
                                   : static_cast<std::uint64_t>(node.index);
    const Key key{node.operation, node.operands, bits};
    if (const auto at = ids_.find(key); at != ids_.end()) return at->second;
    if (full()) return 0;
    const auto id = static_cast<NodeId>(nodes_.size());
    nodes_.push_back(node);
    ids_.emplace(key, id);
    return id;
}

NodeId Graph::simplified(Operation operation, NodeId a, NodeId b, NodeId c) {
    switch (operation) {
    case Operation::add:
        if (is_constant(a, 0)) return b;
        return is_constant(b, 0) ? a : -1;
    case Operation::subtract:
        return is_constant(b, 0) ? a : -1;
    case Operation::multiply:
        if (is_constant(a, 1)) return b;
        return is_constant(b, 1) ? a : -1;
    case Operation::divide:
        return is_constant(b, 1) ? a : -1;
    case Operation::minimum:
    case Operation::maximum:
        return a == b ? a : -1;
    case Operation::both:
        if (is_constant(a)) return node(a).value != 0 ? b : a;
        if (is_constant(b)) return node(b).value != 0 ? a : b;
        return a == b ? a : -1;
    case Operation::either:
        if (is_constant(a)) return node(a).value != 0 ? a : b;
        if (is_constant(b)) return node(b).value != 0 ? b : a;
        return a == b ? a : -1;
    case Operation::negate:
    case Operation::invert:
        return node(a).operation == operation ? node(a).operands[0] : -1;
    case Operation::select:
        if (is_constant(a)) return node(a).value != 0 ? b : c;
        return b == c ? b : -1;
    default:
        return -1;
    }
}

NodeId Graph::apply(Operation operation, NodeId a, NodeId b, NodeId c) {
    const int count = row_of(operation).operands;
    const auto value = [&](NodeId id) { return id >= 0 ? node(id).value : 0; };
    if (is_constant(a) && (count < 2 || is_constant(b)) && (count < 3 || is_constant(c)))
        return constant(result_of(operation, value(a), value(b), value(c)));
    if (const NodeId id = simplified(operation, a, b, c); id >= 0) return id;
    // Operations whose operands may change places have the smaller number first: a + b and b + a are one
    // node.
    if (operation == Operation::add || operation == Operation::multiply || operation == Operation::equal ||
        operation == Operation::both || operation == Operation::either)
        if (a > b) std::swap(a, b);
    Node node;
    node.operation = operation;
    node.operands = {a, b, c};
    return add(node);
}

std::vector<bool> needed_nodes(const Graph& graph, std::span<const NodeId> outputs) {
    std::vector<bool> needed(graph.nodes().size(), false);
    for (const NodeId id : outputs)
        needed[static_cast<std::size_t>(id)] = true;
    for (std::size_t i = needed.size(); i-- > 0;)
        if (needed[i])
            for (const NodeId operand : graph.nodes()[i].operands)
                if (operand >= 0) needed[static_cast<std::size_t>(operand)] = true;
    return needed;
}

double result_of(Operation operation, double a, double b, double c) {
    double sine = 0, cosine = 0;
    switch (operation) {
    case Operation::constant:
    case Operation::uniform:
    case Operation::input:
        return a;
    case Operation::add:
        return a + b;
    case Operation::subtract:
        return a - b;
    case Operation::multiply:
        return a * b;
    case Operation::divide:
        return a / b;
    case Operation::minimum:
        return a < b ? a : b;
    case Operation::maximum:
        return a > b ? a : b;
    case Operation::power:
        return model_pow(a, b);
    case Operation::remainder:
        return std::fmod(a, b);
    case Operation::arc_tangent_2:
        return vector_atan2(a, b);
    case Operation::less:
        return a < b ? 1 : 0;
    case Operation::less_or_equal:
        return a <= b ? 1 : 0;
    case Operation::equal:
        return a == b ? 1 : 0;
    case Operation::both:
        return a != 0 && b != 0 ? 1 : 0;
    case Operation::either:
        return a != 0 || b != 0 ? 1 : 0;
    case Operation::negate:
        return -a;
    case Operation::invert:
        return a != 0 ? 0 : 1;
    case Operation::absolute:
        return std::fabs(a);
    case Operation::square_root:
        return std::sqrt(a);
    case Operation::round_down:
        return std::floor(a);
    case Operation::exponential:
        return model_exp(a);
    case Operation::logarithm:
        return model_log(a);
    case Operation::sine:
        return vector_sincos(a, sine, cosine), sine;
    case Operation::cosine:
        return vector_sincos(a, sine, cosine), cosine;
    case Operation::tangent:
        return vector_sincos(a, sine, cosine), sine / cosine;
    case Operation::arc_sine:
        return vector_asin(a);
    case Operation::arc_cosine:
        return vector_acos(a);
    case Operation::arc_tangent:
        return vector_atan(a);
    case Operation::select:
        return a != 0 ? b : c;
    }
    return 0;
}

bool Graph::depends_on(std::span<const NodeId> outputs, Operation leaf_operation, std::int32_t index) const {
    std::vector<bool> used(nodes_.size());
    for (const NodeId id : outputs)
        used[static_cast<std::size_t>(id)] = true;
    // Operands stand before what is computed from them.
    for (std::size_t i = nodes_.size(); i-- > 0;) {
        if (!used[i]) continue;
        const Node& n = nodes_[i];
        if (n.operation == leaf_operation && n.index == index) return true;
        for (const NodeId operand : n.operands)
            if (operand >= 0) used[static_cast<std::size_t>(operand)] = true;
    }
    return false;
}

} // namespace obscura::models
