// SPDX-License-Identifier: Apache-2.0
// Graph of operations that a model computes: the intermediate form between its text and what runs.
#pragma once

#include "models/graph/operation.hpp"

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

namespace obscura::models {

using NodeId = std::int32_t;

/// One value. Operands have smaller numbers, so the order of the nodes is one in which they can be computed.
struct Node {
    Operation operation = Operation::constant;
    std::array<NodeId, 3> operands{-1, -1, -1};
    double value = 0;       ///< of a constant
    std::int32_t index = 0; ///< of a uniform or input

    friend bool operator==(const Node&, const Node&) = default;
};

/// Growing list of nodes without duplicates: an operation on the same operands is one node, one on constants
/// is a constant, computed as the interpreter does. No loops, jumps or memory: a graph always ends, and costs
/// what it has nodes. It knows nothing of who computes it. Thread-bound.
class Graph {
public:
    /// Largest number of nodes; beyond it, full() is true and new nodes are 0.
    static constexpr std::size_t max_nodes = 40'000;

    NodeId constant(double value);
    NodeId uniform(std::int32_t index) { return leaf(Operation::uniform, index); }
    NodeId input(std::int32_t index) { return leaf(Operation::input, index); }
    NodeId apply(Operation operation, NodeId a, NodeId b = -1, NodeId c = -1);

    [[nodiscard]] const std::vector<Node>& nodes() const noexcept { return nodes_; }
    [[nodiscard]] const Node& node(NodeId id) const { return nodes_[static_cast<std::size_t>(id)]; }
    [[nodiscard]] bool is_constant(NodeId id) const { return node(id).operation == Operation::constant; }
    [[nodiscard]] bool is_constant(NodeId id, double value) const {
        return is_constant(id) && node(id).value == value;
    }
    /// Whether any of `outputs` is computed from that uniform or input.
    [[nodiscard]] bool depends_on(std::span<const NodeId> outputs, Operation leaf, std::int32_t index) const;
    [[nodiscard]] bool full() const noexcept { return nodes_.size() >= max_nodes; }

private:
    struct Key {
        Operation operation;
        std::array<NodeId, 3> operands;
        std::uint64_t bits; ///< of the value, or the index
        friend auto operator<=>(const Key&, const Key&) = default;
    };
    NodeId leaf(Operation operation, std::int32_t index);
    NodeId add(const Node& node);
    /// A node that gives the same as the operation without one; -1: none is known.
    [[nodiscard]] NodeId simplified(Operation operation, NodeId a, NodeId b, NodeId c);

    std::vector<Node> nodes_;
    std::map<Key, NodeId> ids_;
};

/// Whether `outputs` depend on a node, by its number; they do on themselves.
[[nodiscard]] std::vector<bool> needed_nodes(const Graph& graph, std::span<const NodeId> outputs);

/// What one operation gives: the arithmetic of interpreter and constants.
[[nodiscard]] double result_of(Operation operation, double a, double b, double c);

} // namespace obscura::models
