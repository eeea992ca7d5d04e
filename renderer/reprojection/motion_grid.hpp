// SPDX-License-Identifier: Apache-2.0
// Motion field for reprojection: where the pixels of a frame were in an earlier one, found by few camera
// rays.
#pragma once

#include "core/camera/region.hpp"
#include "renderer/camera/projection.hpp"
#include "renderer/integrators/tracer.hpp"
#include "renderer/reprojection/kept_image.hpp"
#include "renderer/world/row_state.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace obscura::renderer {

/// Motion at the corners of cells of 16 x 16 pixels, and 4 pixels apart in cells whose corners see different
/// bodies: each of these nodes is the centre of a camera ray, and what that hits is projected to where the
/// camera saw it in the earlier frame. A node of the sky, or of a body behind, close to the edge of a nearer
/// one moves as that does, so that the edge moves with its own body, and what it had hidden is filled from
/// the farther surface beside it. Lines of a push-broom sensor are rows: what a line sees was in the line of
/// about the same time, and if other poses moved it along the sensor's motion, in the line that the motion
/// had brought there. Rows are found in three steps, each of which needs the one before on the rows about it;
/// different threads may do different rows of a step.
class MotionGrid {
public:
    static constexpr std::int32_t cell_px = 16, fine_px = 4, fine_cells = cell_px / fine_px;

    /// Scene of a row of nodes.
    struct View {
        const Projection& lens;     ///< of the new frame; see RowState::beta
        const Projection& own_lens; ///< of the camera at rest
        const RowState& row;
        Time mid; ///< of the row
        Tracer& tracer;
        std::vector<std::int32_t>& candidates; ///< scratch space
        const KeptImage& from;
    };

    class Memory;
    /// Takes the memory for an area, and forgets all nodes; false if it is too little.
    [[nodiscard]] bool place(const KeptWindow& window, Memory& memory);
    /// Forgets all nodes.
    void restart();
    /// Rows of cells; rows of corners are one more.
    [[nodiscard]] std::int32_t cell_rows() const { return cell_rows_; }
    [[nodiscard]] std::int32_t cell_row_of(std::int32_t y) const { return (y - first_y_) / cell_px; }
    [[nodiscard]] std::int32_t y_of(std::int32_t cell_row, std::int32_t fine_row = 0) const {
        return first_y_ + cell_row * cell_px + fine_row * fine_px;
    }
    enum class Step : std::uint8_t { none, corners, inner, joined };
    /// The last step that is done of the nodes of a row of cells, without its lower border.
    [[nodiscard]] Step& done(std::int32_t cell_row) { return done_[static_cast<std::size_t>(cell_row)]; }

    /// Step 1: the corners at the upper border of row `r` of cells.
    void trace_corners(std::int32_t r, const View& view);
    /// Step 2, after step 1 of the rows r - 1 to r + 1. `view_of(fine_row)` gives the scene of a row of
    /// nodes, which it sets up.
    [[nodiscard]] bool has_inner(std::int32_t r, std::int32_t fine_row) const;
    void trace_inner(std::int32_t r, std::int32_t fine_row, const View& view);
    /// Step 3, after step 1 of the rows r - 2 to r + 2 and step 2 of the rows r - 1 to r + 1.
    void join(std::int32_t r);

    /// Largest motion of a body in the image, px, since the light of row `y` was kept, after step 3 of its
    /// row of cells and the next; infinite if the kept rows do not have what the row sees.
    [[nodiscard]] float largest_px(std::int32_t y);

    /// Motion of a row of pixels.
    struct Row {
        /// Displacement to where a pixel was in the earlier frame, and the factor from the weight of a
        /// radiance there to its own; whole cells.
        std::vector<float> dx, dy, gain;
        std::vector<std::uint8_t> filled; ///< 1: hidden or outside in the earlier frame
        std::vector<std::uint8_t> dark;   ///< by cell: it has no light, and nothing else is set
        std::size_t first = 0;            ///< of the area
        std::int32_t filled_count = 0;    ///< in the area

        /// Makes room for an area `width` pixels wide, wherever it begins.
        void resize(std::size_t width);
    };
    /// Fills `row` for row `y` of the sensor, after step 3 of its row of cells and the next. `lit`: the rows
    /// of the earlier frame.
    void take(std::int32_t y, std::span<const LitColumns> lit, Row& row) const;

private:
    /// What a node sees and its motion.
    static constexpr std::int32_t not_traced = -2, sky = -1;
    struct Motion {
        float dx = 0, dy = 0, gain = 1;
        float px = 0; ///< in the image, at the node's own row; infinite: it was in no row
    };
    struct Target {
        Motion motion;
        std::uint8_t filled = 0;
        std::uint8_t of_body = 0; ///< moves as a body does
    };
    struct Line;
    [[nodiscard]] std::size_t at(std::int32_t column, std::int32_t row) const {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
               static_cast<std::size_t>(column);
    }
    [[nodiscard]] bool mixed(std::int32_t cell, std::int32_t cell_row) const;
    void trace(std::span<const std::int32_t> columns, std::int32_t row, const View& view);
    [[nodiscard]] static Motion motion_of(const View& view, std::int32_t body, Vec3 direction, double t_m,
                                          double weight_sr, double x, double y);
    void join_node(std::int32_t column, std::int32_t row);

    [[nodiscard]] static Motion line_motion_of(const View& view, std::int32_t body, Vec3 point,
                                               double weight_sr, double x, double y);
    [[nodiscard]] bool beyond_lines(std::int32_t y) const;

    Region area_{};
    bool lines_ = false; ///< rows are lines of a push-broom sensor
    std::int32_t first_x_ = 0, first_y_ = 0, cells_ = 0, cell_rows_ = 0, columns_ = 0, rows_ = 0;
    // By fine nodes.
    std::span<std::int32_t> body_;
    std::span<float> range_;
    std::span<Motion> own_;
    std::span<Target> joined_;
    // By rows of cells.
    std::span<Step> done_;
    std::span<std::uint8_t> hits_; ///< whether any of the upper corners sees a body
    std::span<float> largest_;     ///< of the motions of bodies; negative: not known
};

/// Memory that the grids of a frame's windows share; one takes its part after the other.
class MotionGrid::Memory {
public:
    /// For `grids` areas of `rows` rows in all, of at most `width` columns.
    Memory(std::size_t width, std::size_t rows, std::size_t grids);
    /// All of it is free again.
    void clear() { nodes_taken_ = cell_rows_taken_ = 0; }

private:
    friend class MotionGrid;
    std::vector<std::int32_t> body_;
    std::vector<float> range_;
    std::vector<Motion> own_;
    std::vector<Target> joined_;
    std::vector<Step> done_;
    std::vector<std::uint8_t> hits_;
    std::vector<float> largest_;
    std::size_t nodes_taken_ = 0, cell_rows_taken_ = 0;
};

} // namespace obscura::renderer
