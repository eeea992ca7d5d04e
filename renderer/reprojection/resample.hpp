// SPDX-License-Identifier: Apache-2.0
// Resampling of an image row by row, six points along each axis.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace obscura::renderer {

/// Columns [first, end) of a row outside of which it is 0.
struct LitColumns {
    std::int32_t first = 0, end = 0;
};

/// Points further from a pixel do not belong to it, px.
constexpr float resample_reach = 4;

/// An image plane of `height` rows of `width`; beyond its border, that is repeated.
struct ResamplePlane {
    const float* values;
    std::int32_t width, height;
};

/// out[i] = gain[i] times the image at (x + i + dx[i], y + dy[i]), for 0 <= i < dx.size(), interpolated by
/// polynomials of the fifth degree (Lagrange) along each axis, not below 0. Exact at whole pixels; half way
/// between them a wave of eight pixels keeps 0.997 of its amplitude, one of four pixels 0.95 (0.98 and 0.88
/// with the four points of Catmull and Rom). Displacements are below 1e6 px. Real-time safe; the same result
/// on any processor.
void resample_row(const ResamplePlane& plane, std::int32_t x, std::int32_t y, std::span<const float> dx,
                  std::span<const float> dy, std::span<const float> gain, double* out);

} // namespace obscura::renderer
