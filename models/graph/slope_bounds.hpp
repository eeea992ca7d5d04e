// SPDX-License-Identifier: Apache-2.0
// Bounds of the gradient and of the second derivatives of a graph over a box.
#pragma once

#include "models/graph/graph.hpp"
#include "models/graph/interval.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace obscura::models {

/// A function of three inputs over a box, by forward differentiation in interval arithmetic.
struct SlopeBounds {
    Interval value{};
    std::array<Interval, 3> gradient{};
    /// Second derivatives xx, yy, zz, xy, xz, yz of the smooth pieces.
    std::array<Interval, 6> second{};
    /// The slope along lines may jump upwards (as of a maximum) or downwards (as of a minimum); both where
    /// the value may jump.
    bool bends_up = false, bends_down = false;

    /// Largest second derivative along any line.
    [[nodiscard]] double max_bend() const noexcept;
    /// Largest slope along any line.
    [[nodiscard]] double max_slope() const noexcept;
};

/// Computes bounds of one node of a graph, box by box. Inputs 0, 1 and 2 are the coordinates. Thread-bound.
class SlopeBounder {
public:
    /// `graph` must outlive it.
    SlopeBounder(const Graph& graph, NodeId output, std::span<const double> uniforms);

    [[nodiscard]] const SlopeBounds& over(const std::array<Interval, 3>& box);

private:
    [[nodiscard]] SlopeBounds bounds_of(std::size_t node, const std::array<Interval, 3>& box) const;
    [[nodiscard]] SlopeBounds of_function(const Node& node, const SlopeBounds& a) const;
    [[nodiscard]] SlopeBounds of_root(const Node& node, const SlopeBounds& a) const;
    /// The nodes whose squares a node is the sum of, if it is one.
    [[nodiscard]] bool find_squares(NodeId node, std::vector<NodeId>& squared) const;
    [[nodiscard]] const SlopeBounds& at(NodeId id) const { return known_[static_cast<std::size_t>(id)]; }

    const Graph& graph_;
    NodeId output_;
    std::vector<std::size_t> order_; ///< nodes that the output depends on
    std::vector<SlopeBounds> known_;
    std::vector<bool> varies_;                 ///< by node: with the inputs
    std::vector<std::vector<NodeId>> squares_; ///< by node: of roots of sums of squares
    std::vector<double> uniforms_;
};

} // namespace obscura::models
