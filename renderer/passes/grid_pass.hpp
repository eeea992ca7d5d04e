// SPDX-License-Identifier: Apache-2.0
// Grid pass: points of shared and of sparse sample grids, traced before the rows that take them.
#pragma once

#include "core/camera/frame_quality.hpp"
#include "renderer/integrators/sparse_grid.hpp"
#include "renderer/passes/built_scene.hpp"
#include "renderer/passes/pass_request.hpp"
#include "renderer/passes/row_block.hpp"
#include "renderer/passes/row_scheduler.hpp"
#include "renderer/passes/scratch.hpp"

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace obscura::renderer {

/// Index of the sparse grid of a level in RowBlock::sparse. At QualityLevel::grid it serves where no grid is
/// shared.
[[nodiscard]] constexpr std::size_t sparse_index(QualityLevel level) {
    return static_cast<std::size_t>(level) - static_cast<std::size_t>(QualityLevel::grid);
}

/// Whether a row takes the sample grid of its frame: its only instant is that of the frame's rows. Depends on
/// the row alone, whatever other rows the request has.
[[nodiscard]] bool shares_samples(const BuiltScene& built, const PassRequest& request, const RowTime& row,
                                  QualityLevel level, Scratch& s);

/// Traces the points of the shared grid that the request's rows need; false when cancelled.
bool fill_sample_grid(const RowScheduler& workers, const PassRequest& request,
                      const std::atomic<bool>* cancel, RowBlock& rows);
/// The same of the sparse grid of a level.
bool fill_sparse_grid(const RowScheduler& workers, const PassRequest& request, QualityLevel level,
                      const std::atomic<bool>* cancel, RowBlock& rows);

/// Whether the grids have what row `r` needs. Real-time safe.
[[nodiscard]] bool grids_ready(const BuiltScene& built, const PassRequest& request, const RowBlock& rows,
                               std::int32_t r, Scratch& s);
/// Interpolates the row's pixels from a sparse grid. Returns false if all are dark. Real-time safe.
bool take_sparse(const PassRequest& request, std::int32_t y, const SparseGrid& grid, std::size_t channels,
                 Scratch& s);

} // namespace obscura::renderer
