// SPDX-License-Identifier: Apache-2.0
// Request of rows as the passes see it: with the memory behind its opaque members.
#pragma once

#include "core/camera/frame_quality.hpp"
#include "renderer/passes/kept_light.hpp"
#include "renderer/passes/scratch.hpp"
#include "renderer/renderer.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace obscura::renderer {

/// Which rows of a frame a run over rows is for: its key (TileLoading::frame_key()), and the memory of the
/// calling thread if that does them alone.
struct RowsOf {
    std::uint64_t frame = 0;
    Scratch* alone = nullptr;
};

/// A RenderRequest and what its pointers to FrameSamples, ReprojectionSource and Workspace stand for. Plain
/// data of one call of render(), which outlives the passes.
struct PassRequest : RenderRequest {
    PassRequest(const RenderRequest& request, const RowsOf& rows_of, KeptLight* keep_in,
                KeptLight* taken_from)
        : RenderRequest(request), of(rows_of), keep_light(keep_in), from_light(taken_from) {}

    /// Part of a row of a sensor that scans: the row of the row block that it belongs to, its first column
    /// there, and the width of that row.
    struct Part {
        std::int32_t row = 0, column = 0, width = 0; ///< width 0: whole rows
    };

    RowsOf of;
    Part part{};
    KeptLight* keep_light; ///< of RenderRequest::keep
    KeptLight* from_light; ///< of RenderRequest::from

    [[nodiscard]] QualityLevel level_of(std::int32_t r) const {
        return levels.empty() ? QualityLevel::full : levels[static_cast<std::size_t>(r)];
    }
    /// Rows of a plane of the irradiance.
    [[nodiscard]] std::int32_t rows_of_plane() const { return plane_rows > 0 ? plane_rows : rows; }
    /// Row of the sensor that row `r` of the request is, and its row in what is kept of its window.
    [[nodiscard]] std::int32_t sensor_y(std::int32_t r) const {
        return window.y + first_row + (line ? 0 : r);
    }
    [[nodiscard]] std::int32_t kept_y(std::int32_t r) const { return line ? *line + r : sensor_y(r); }
    [[nodiscard]] KeptLight::Window& keep_window() const { return keep_light->windows[kept_window]; }
    [[nodiscard]] KeptLight::Window& from_window() const { return from_light->windows[kept_window]; }
};

} // namespace obscura::renderer
