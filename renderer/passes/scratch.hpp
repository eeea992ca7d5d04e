// SPDX-License-Identifier: Apache-2.0
// Scratch memory of a render thread, kept from row to row so that nothing is allocated after the first.
#pragma once

#include "core/camera/frame.hpp"
#include "renderer/camera/aberration.hpp"
#include "renderer/camera/projection.hpp"
#include "renderer/integrators/point_splatter.hpp"
#include "renderer/integrators/tracer.hpp"
#include "renderer/planets/surface_tiles.hpp"
#include "renderer/reprojection/motion_grid.hpp"
#include "renderer/work_clock.hpp"
#include "renderer/world/row_state.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace obscura::renderer {

/// States of the scene at the instants of a row.
struct RowSetUp {
    std::vector<RowState> rows;   ///< and unused ones
    std::vector<SweptBody> swept; ///< over those instants
    /// The request and exposure that they are set up for; request 0: none.
    std::uint64_t request = 0;
    RowTime time{};
    std::uint32_t instants = 0;
};

/// Scratch memory of one thread. Thread-bound.
struct Scratch {
    RowSetUp whole;  ///< at the instants of the exposure
    RowSetUp fewer;  ///< at those of a level with fewer
    RowSetUp middle; ///< at the middle of the exposure, for what is kept
    MotionGrid::Row motion_of_row;
    std::optional<MovingLens> moving_lens;          ///< with aberration
    const Projection* lens = nullptr;               ///< of the row begun last: moving_lens or the camera's
    std::vector<double> light;                      ///< channels x pixels, in the tracer's units, sr
    std::vector<double> starlight;                  ///< bands x pixels, W/m2
    std::vector<double> per_pixel;                  ///< factor from irradiance to the requested quantity
    std::vector<double> variance;                   ///< per pixel; 0: no samples, and between rows
    std::size_t first_sampled = 0, end_sampled = 0; ///< pixels that may have some
    std::vector<float> wing_row;
    std::vector<double> wing_light;   ///< of a row of a sensor that scans, as `light`
    std::vector<float> scanned;       ///< bands x pixels of a part of such a row
    std::vector<PointJob> point_jobs; ///< of a row that shares its points with no other
    BodyPoints points;
    std::vector<std::int32_t> candidates;
    RayCounts counts;
    WorkClock work;
    std::vector<SurfaceTiles::Pin> pins;      ///< of all terrains, while a row is rendered
    std::vector<std::uint64_t> tile_versions; ///< of the bodies, for the truth of a frame
    DetailCounts detail;                      ///< of the row
    std::uint64_t filled = 0;                 ///< pixels of the row that the earlier frame does not show
    std::uint64_t frame = 0;                  ///< see TileLoading::frame_key()
    bool waits = false;                       ///< for tiles, whatever the settings
    RowTime measured{};                       ///< the exposure that `motion` belongs to
    double motion = 0;                        ///< see motion_px()
    std::int32_t row = 0;                     ///< of the request, that is being rendered

    /// `count` columns from `first` on, of a row of `width`, have samples.
    void add_sampled(std::int32_t first, std::int32_t count, std::int32_t width) {
        first_sampled = std::min(first_sampled, static_cast<std::size_t>(std::max(first, 0)));
        end_sampled = std::max(end_sampled, static_cast<std::size_t>(std::min(first + count, width)));
    }
};

/// Variance of pixels that have samples, even if all are equal: 0 means none. Any positive number.
constexpr double least_variance = std::numeric_limits<double>::min();

/// Whether pixel `x` of a row of `width` pixels, channel by channel, has light in some channel.
[[nodiscard]] inline bool has_light(std::span<const double> light, std::size_t x, std::size_t width) {
    for (; x < light.size(); x += width)
        if (light[x] > 0) return true;
    return false;
}

} // namespace obscura::renderer
