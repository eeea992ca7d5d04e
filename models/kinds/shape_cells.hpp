// SPDX-License-Identifier: Apache-2.0
// Octree over the bounding ball of an implicit surface, with bounds of the function and its slopes by cell.
#pragma once

#include "core/geometry.hpp"
#include "models/graph/slope_bounds.hpp"

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace obscura::models {

/// What is known of the function in a cell.
struct ShapeCell {
    enum class State : std::uint8_t { outside, inside, surface };
    State state = State::outside;
    /// The slope along lines may jump that way: see SlopeBounds.
    bool bends_up = false, bends_down = false;
    double max_slope = 0; ///< along any line
    double max_bend = 0;  ///< second derivative along any line, of the smooth pieces
    std::array<Interval, 3> gradient{};
};

/// Cells of a cube about the origin. Immutable; thread-safe.
class ShapeCells {
public:
    /// Cells along an edge before any is divided.
    static constexpr std::int32_t side = 16;
    /// Divisions of a cell whose bounds are loose, and of one where the slope has none.
    static constexpr int max_divisions = 2, max_divisions_without_bound = 5;
    /// Boxes that are bounded; beyond, cells stay as they are.
    static constexpr int max_boxes = 60'000;

    /// A cell at a place, and the distance along a ray at which the ray leaves it.
    struct Found {
        const ShapeCell* cell = nullptr;
        double end = 0;
    };

    /// One cell without an end: bounds that are said to hold everywhere.
    explicit ShapeCells(const ShapeCell& everywhere);
    /// `bound_over`: bounds over a box, with the place of its middle.
    ShapeCells(double radius_m,
               const std::function<SlopeBounds(const std::array<Interval, 3>&, Vec3)>& bound_over);

    /// At `origin` + `s` `direction`. Real-time safe.
    [[nodiscard]] Found find(Vec3 origin, Vec3 direction, double s) const noexcept;

    [[nodiscard]] const std::vector<ShapeCell>& cells() const noexcept { return cells_; }
    /// Whether there is a cell whose slope has no bound, and its middle.
    [[nodiscard]] bool is_unbounded() const noexcept { return unbounded_; }
    [[nodiscard]] Vec3 unbounded_at() const noexcept { return unbounded_at_; }
    [[nodiscard]] std::size_t surface_cells() const noexcept;

private:
    void divide(std::size_t slot, Vec3 low, double edge, int divisions,
                const std::function<SlopeBounds(const std::array<Interval, 3>&, Vec3)>& bound_over);

    double half_edge_ = 0; ///< of the cube; 0: one cell
    /// Index in cells_, or, negative, ~index in children_ of eight of its own.
    std::vector<std::int32_t> slots_;
    std::vector<ShapeCell> cells_;
    int boxes_ = 0;
    bool unbounded_ = false;
    Vec3 unbounded_at_{};
};

} // namespace obscura::models
