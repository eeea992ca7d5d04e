// SPDX-License-Identifier: Apache-2.0
// Estimate of a frame's light and of its rendering time, from as many of its rows as a time limit allows.
#pragma once

#include "core/camera/frame.hpp"
#include "renderer/renderer.hpp"

#include <cstdint>
#include <functional>
#include <span>

namespace obscura::tools {

/// The frame whose rows are rendered: windows of the sensor, one below the other, with a time for each row.
struct EstimatedFrame {
    std::span<const FrameWindow> windows;
    std::span<const RowTime> rows; ///< of all windows, see FrameWindow::image_y
    bool push_broom = false;       ///< every row is the first one of its window
    std::int32_t block_rows = 64;  ///< rows that are rendered together
};

/// Duration of the whole frame's rendering, and the part of it that was rendered.
struct FrameCost {
    double seconds = 0;    ///< as the machine is loaded
    double cpu_s = 0;      ///< of all threads
    bool at_least = false; ///< not even one block was ready in time
    double share = 0;      ///< of the rows whose light was used, 0 to 1
};

/// Receives the irradiance of some rows: bands x rows x columns, and the rows' times.
using UseRows = std::function<void(std::span<const float> irradiance, std::span<const RowTime> rows)>;

/// Told after each block whose light was used which share of the frame's rows it has; ends the estimate by
/// returning false.
using RowsDone = std::function<bool(double share)>;

/// Renders blocks of rows all over the frame until all are done or about `limit_s` have passed. A frame with
/// a terrain is rendered twice: first whole, as long as that takes up to 5 minutes, which makes the tiles and
/// gives the light; then within `limit_s` for the time that later frames take.
[[nodiscard]] FrameCost estimate_frame(const renderer::Renderer& renderer, const EstimatedFrame& frame,
                                       double limit_s, const UseRows& use, const RowsDone& rows_done);

} // namespace obscura::tools
