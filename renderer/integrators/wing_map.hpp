// SPDX-License-Identifier: Apache-2.0
// Wing map: light that the PSF's wings bring from resolved bodies, at one instant, by convolution.
#pragma once

#include "core/time.hpp"
#include "renderer/camera/projection.hpp"
#include "renderer/camera/psf.hpp"
#include "renderer/camera/wing_kernels.hpp"
#include "renderer/integrators/tracer.hpp"
#include "renderer/world/row_state.hpp"

#include <cstdint>
#include <limits>
#include <vector>

namespace obscura::renderer {

/// Grid rows of floats by index, made when they are needed; they keep their memory when cleared.
class GridRows {
public:
    struct Row {
        std::vector<float> values;
        std::uint8_t stage = 0;              ///< of the work on it; 0: none
        std::int32_t first_lit = 0, lit = 0; ///< columns that are not 0, from the first of the grid
    };
    void clear();
    /// Makes the rows [from, to].
    void include(std::int32_t from, std::int32_t to);
    [[nodiscard]] Row& at(std::int32_t row) { return rows_[static_cast<std::size_t>(row - first_)]; }
    [[nodiscard]] const Row& at(std::int32_t row) const {
        return rows_[static_cast<std::size_t>(row - first_)];
    }

private:
    std::int32_t first_ = 0;
    std::vector<Row> rows_;
};

/// Coarse pre-pass of the scene in and around some columns of the sensor, convolved with WingKernels; rows
/// are made as they are asked for. Every value is a function of the scene, the seed, the time and its place
/// on the sensor alone. Cells are square on the focal plane, and their sides are in pitches of the columns.
///
/// Each level samples the scene on its own: a few stratified samples per cell, more where they differ. Bodies
/// of a few cells, and thin crescents, are sampled by points of their discs instead; targeted bodies are left
/// to the PointSplatter, wings and all.
///
/// The work is done in steps; jobs of one step are independent of each other and may run on several threads.
/// A step that is not finished can be begun again.
class WingMap {
public:
    struct Job {
        std::size_t level;
        std::int32_t row;
    };
    /// The scene at the map's time, for one thread.
    struct View {
        const Projection& lens; ///< with aberration
        const RowState& row;
        Tracer& tracer; ///< with as many channels as the kernels
        std::vector<std::int32_t>& candidates;
        std::uint64_t seed;
    };

    /// All arguments must outlive the map.
    WingMap(const Psf& psf, const WingKernels& kernels) : psf_(psf), kernels_(kernels) {}

    /// Forgets everything and begins with the columns [first_x, first_x + width) at `time`.
    void begin(Time time, std::int32_t first_x, std::int32_t width);
    /// Makes holds() false until begin().
    void forget() { width_ = 0; }
    [[nodiscard]] Time time() const { return time_; }
    [[nodiscard]] bool holds(Time time, std::int32_t first_x, std::int32_t width) const {
        return width_ > 0 && time_ == time && first_x >= first_x_ && first_x + width <= first_x_ + width_;
    }

    /// Step 1, once: decides how each body is sampled.
    void set_bodies(const Projection& lens, const RowState& row);
    [[nodiscard]] bool has_bodies() const { return bodies_set_; }
    /// Step 2, once: samples the bodies that are small, in `point_jobs()` jobs; then sort_points().
    [[nodiscard]] std::int32_t point_jobs() const { return static_cast<std::int32_t>(point_jobs_.size()); }
    void trace_points(std::int32_t job, const View& view);
    void sort_points();
    [[nodiscard]] bool has_points() const { return points_sorted_; }
    /// Finds what is missing for the sensor's rows [first_y, last_y]: jobs of the steps 3 to 6.
    void plan(std::int32_t first_y, std::int32_t last_y);
    /// Step 3: samples cells.
    [[nodiscard]] const std::vector<Job>& cell_jobs() const { return cell_jobs_; }
    void trace_cells(Job job, const View& view);
    /// Step 4: gathers the light of nodes.
    [[nodiscard]] const std::vector<Job>& source_jobs() const { return source_jobs_; }
    void gather(Job job);
    /// Step 5: convolves.
    [[nodiscard]] const std::vector<Job>& result_jobs() const { return result_jobs_; }
    void convolve(Job job);
    /// Step 6, level by level from the last but one to 0: adds the level above.
    void add_level_above(Job job, std::vector<float>& scratch);

    /// Adds `share` of the wings in row `y` of the sensor to `light` (channels x width) of the pixels from
    /// `first_x`. `scratch`: any.
    void add(std::int32_t y, double share, std::int32_t first_x, std::int32_t width,
             std::vector<double>& light, std::vector<float>& scratch) const;

private:
    static constexpr int never = std::numeric_limits<int>::max();

    /// A sample of a small body.
    struct Point {
        double x = 0, y = 0;    ///< in pitches of the columns
        int from_level = never; ///< levels that it belongs to; never: no light
        std::uint32_t order = 0;
        float amount[max_channels];
    };
    struct PointJob {
        std::int32_t body;
        LitDisc::Part part;
        int from_level;
        std::uint32_t first, count, of; ///< samples of the part's
        std::size_t at;                 ///< index of the first in points_
        bool of_facets;                 ///< of BodyState::lit_facets instead
    };
    struct Level {
        std::int32_t first_column = 0, columns = 0; ///< of results; multiples of 16
        /// Squared chords within which bodies are near the cells of a packet, as BodyState::reach_chord2.
        std::vector<double> near_chord2;
        double near_rad = 0;
        bool sampled = false; ///< some body is sampled by cells
        GridRows cells, sources, results;
    };

    struct CellSamples;

    /// Columns of cells and sources on either side of those of results.
    static constexpr std::int32_t margin = 2 * packet_size;
    static_assert(margin > WingKernels::reach);
    static std::int32_t source_columns(const Level& l) { return l.columns + 2 * margin; }
    void trace_block(std::size_t level, std::int32_t row, std::int32_t column, float* top, float* bottom,
                     const View& view) const;
    /// Adds the level's points to the sources of a row.
    void deposit_points(std::size_t level, std::int32_t row, float* sources) const;

    const Psf& psf_;
    const WingKernels& kernels_;
    Time time_{};
    std::int32_t first_x_ = 0, width_ = 0;
    bool bodies_set_ = false, points_sorted_ = false;
    std::vector<int> small_from_; ///< by body: the first level at which it is sampled by points
    std::vector<PointJob> point_jobs_;
    std::vector<Point> points_;
    std::vector<Level> levels_;
    std::vector<Job> cell_jobs_, source_jobs_, result_jobs_;
};

} // namespace obscura::renderer
