// SPDX-License-Identifier: Apache-2.0
// Row block: memory that the rows of one request share.
#pragma once

#include "core/camera/frame.hpp"
#include "renderer/integrators/point_splatter.hpp"
#include "renderer/integrators/sample_grid.hpp"
#include "renderer/integrators/sparse_grid.hpp"
#include "renderer/integrators/star_rows.hpp"
#include "renderer/integrators/wing_maps.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <vector>

namespace obscura::renderer {

/// Small bodies of a frame whose rows all have the same exposure, as points of the image.
struct SharedPoints {
    std::optional<RowTime> time;  ///< of the rows; empty: each has its own
    std::vector<PointJob> jobs;   ///< in order of their instants
    std::vector<BodyPoints> done; ///< of each job
};

/// Data shared by the rows of one request (a row block). Filled by the passes before the rows, read by them.
struct RowBlock {
    std::uint64_t request = 0; ///< its number, from 1
    SharedPoints points;
    StarsInView stars;
    std::optional<SampleGridKernel> kernel; ///< of `grid`; empty: no shared samples
    SampleGrid grid;
    std::vector<std::uint8_t> grid_filled; ///< by its rows
    std::array<SparseGrid, 3> sparse;      ///< from QualityLevel::grid on
    std::array<bool, 3> sparse_begun{};    ///< those have been reset for this frame
    std::vector<std::int32_t> grid_jobs;   ///< rows of a grid to be filled
    std::uint64_t kept_by = 0;             ///< number of the renderer of kept samples
    bool kept = false;                     ///< the samples belong to a frame that has begun
    std::optional<WingMaps> wings;         ///< empty: the PSF has none
    std::vector<RowTime> middles;          ///< scratch space of fill_wings()
    std::vector<RowTime> spans;            ///< of rows whose pixels have times of their own
    /// Ends rows early: of requests none of whose rows is used if it becomes true.
    const std::atomic<bool>* cancel = nullptr;
};

} // namespace obscura::renderer
