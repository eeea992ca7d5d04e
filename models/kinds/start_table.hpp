// SPDX-License-Identifier: Apache-2.0
// Table over a rectangle with bilinear interpolation, from which Newton's steps start.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace obscura::models {

/// Square grid of nodes with up to three numbers each. Thread-safe once it is filled.
class StartTable {
public:
    static constexpr std::size_t side = 65; ///< nodes

    StartTable() = default;
    StartTable(std::array<double, 2> first, std::array<double, 2> last)
        : first_(first),
          step_{(last[0] - first[0]) / (side - 1), (last[1] - first[1]) / (side - 1)},
          nodes_(side * side) {}

    [[nodiscard]] bool empty() const noexcept { return nodes_.empty(); }
    [[nodiscard]] std::array<double, 2> place(std::size_t index) const noexcept {
        return {first_[0] + step_[0] * static_cast<double>(index % side),
                first_[1] + step_[1] * static_cast<double>(index / side)};
    }
    [[nodiscard]] std::array<double, 3>& node(std::size_t index) noexcept { return nodes_[index]; }
    [[nodiscard]] const std::array<double, 3>& node(std::size_t index) const noexcept {
        return nodes_[index];
    }

    /// Value at a place; beyond the rectangle that of its rim. Real-time safe.
    [[nodiscard]] std::array<double, 3> at(double x, double y) const noexcept {
        double u = 0, v = 0;
        const std::size_t column = cell((x - first_[0]) / step_[0], u);
        const std::size_t row = cell((y - first_[1]) / step_[1], v);
        const std::array<double, 3>* const corner = nodes_.data() + row * side + column;
        std::array<double, 3> value{};
        for (std::size_t k = 0; k < value.size(); ++k) {
            const double top = corner[0][k] + u * (corner[1][k] - corner[0][k]);
            const double bottom = corner[side][k] + u * (corner[side + 1][k] - corner[side][k]);
            value[k] = top + v * (bottom - top);
        }
        return value;
    }

private:
    /// Cell of a coordinate in steps, and the place in it, 0..1.
    static std::size_t cell(double steps, double& within) noexcept {
        const double inside = steps > 0 ? (steps < side - 1 ? steps : side - 1) : 0; // NaN: 0
        const auto index = static_cast<std::size_t>(inside);
        const std::size_t whole = index < side - 1 ? index : side - 2;
        within = inside - static_cast<double>(whole);
        return whole;
    }

    std::array<double, 2> first_{}, step_{1, 1};
    std::vector<std::array<double, 3>> nodes_;
};

} // namespace obscura::models
