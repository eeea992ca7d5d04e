// SPDX-License-Identifier: Apache-2.0
// Forward-mode derivatives of a graph, as further nodes of it.
#pragma once

#include "models/graph/graph.hpp"

#include <cstdint>
#include <map>
#include <span>
#include <vector>

namespace obscura::models {

/// Derivatives of `nodes` along a direction: `rates` has the rate of each input, by its index, as a node;
/// other inputs and all uniforms are constant. What is cut by a comparison (minimum, maximum, absolute,
/// select) has the derivative of the branch taken; steps have 0. Roots at 0, arc sines and cosines at 1 and
/// arc tangents at the origin have a very large derivative instead of an infinite one, so that 0 times it is
/// 0.
[[nodiscard]] std::vector<NodeId> derivatives(Graph& graph, std::span<const NodeId> nodes,
                                              const std::map<std::int32_t, NodeId>& rates);

/// Copies `nodes` of `from` into `into`, with inputs[i] in place of input i; uniforms keep their index.
[[nodiscard]] std::vector<NodeId> inserted(Graph& into, const Graph& from, std::span<const NodeId> nodes,
                                           std::span<const NodeId> inputs);

} // namespace obscura::models
