// SPDX-License-Identifier: Apache-2.0
// Where the time of rendering goes: parts of the work, by the time of the render threads.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace obscura::renderer {

/// Parts of rendering a row.
enum class RenderPart : std::uint8_t {
    setup,    ///< state of camera and bodies at each instant of a row's exposure
    sampling, ///< camera rays of the pixels and what follows from them
    grid,     ///< the shared sample grid; the motion of reprojected rows
    wings,    ///< wings of the point spread function
    points,   ///< stars and sub-pixel bodies, at each instant
    rest,     ///< all else, such as stray light and the conversion to irradiance
};
constexpr std::size_t render_part_count = 6;

/// Totals since the renderer was made; the difference of two belongs to what was rendered between. Times are
/// sums over the render threads.
struct RenderWork {
    std::array<std::int64_t, render_part_count> part_ns{}; ///< by RenderPart, other programs' time included
    /// A sample of that time: elapsed, and in which the threads ran. The rest went to other programs.
    std::int64_t measured_ns = 0, measured_cpu_ns = 0;
    std::uint64_t preemptions = 0; ///< involuntary context switches of the threads
    std::uint64_t page_faults = 0; ///< of the threads, for memory that came from disk
    std::uint64_t rows = 0;        ///< rows rendered
    std::uint64_t instants = 0;    ///< of those rows
    std::uint64_t rays = 0, samples = 0;
    /// Hits on terrains, and of those the ones on cells wider than asked for by a factor above 1, 2, 4 and 8:
    /// the level-of-detail deficit. 0 where rendering waits for tiles.
    std::uint64_t surface_hits = 0;
    std::array<std::uint64_t, 4> surface_coarser{};
    std::uint64_t tiles_missed = 0; ///< look-ups of tiles that were not there
    /// Rays to shapes of users whose hit, or that they hit nothing, is not sure.
    std::uint64_t rays_doubtful = 0;
    /// Pixels of reprojected rows that were hidden in the earlier frame, or outside of it.
    std::uint64_t pixels_filled = 0;

    [[nodiscard]] std::int64_t& operator[](RenderPart part) noexcept {
        return part_ns[static_cast<std::size_t>(part)];
    }
    [[nodiscard]] std::int64_t operator[](RenderPart part) const noexcept {
        return part_ns[static_cast<std::size_t>(part)];
    }
    RenderWork& operator-=(const RenderWork& before) noexcept {
        for (std::size_t i = 0; i < render_part_count; ++i)
            part_ns[i] -= before.part_ns[i];
        measured_ns -= before.measured_ns;
        measured_cpu_ns -= before.measured_cpu_ns;
        preemptions -= before.preemptions;
        page_faults -= before.page_faults;
        rows -= before.rows;
        instants -= before.instants;
        rays -= before.rays;
        samples -= before.samples;
        surface_hits -= before.surface_hits;
        for (std::size_t i = 0; i < surface_coarser.size(); ++i)
            surface_coarser[i] -= before.surface_coarser[i];
        tiles_missed -= before.tiles_missed;
        rays_doubtful -= before.rays_doubtful;
        pixels_filled -= before.pixels_filled;
        return *this;
    }
    [[nodiscard]] friend RenderWork operator-(RenderWork after, const RenderWork& before) noexcept {
        return after -= before;
    }
};

} // namespace obscura::renderer
