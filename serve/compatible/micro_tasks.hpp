// SPDX-License-Identifier: Apache-2.0
// Micro tasks of the published client: pixels with a number of samples, of which a picture is rendered in
// parts.
#pragma once

#include "core/camera/region.hpp"
#include "service/compatible/value.hpp"

#include <cstdint>
#include <vector>

namespace obscura::serve::compatible {

/// Rows of nine numbers: cluster, column, row from the top, samples, object (-1: all), start and end of the
/// exposure (s), weight, flags.
///
/// One row for each pixel, rows in order; cluster: number of the 16 x 16 pixels that it belongs to.
[[nodiscard]] service::compatible::List micro_tasks(std::int32_t width, std::int32_t height,
                                                    std::uint32_t samples, double exposure_s);

/// Weight of each pixel of the picture by such rows, 0 where there is none; those of one pixel add up to at
/// most 1. Throws Failure for rows that are none, and pixels outside.
[[nodiscard]] std::vector<float> weights_of(const service::compatible::Value& tasks, std::int32_t width,
                                            std::int32_t height);

/// Windows that cover the pixels of some weight, and a few others: to begin a window costs more than some
/// pixels. They do not overlap.
[[nodiscard]] std::vector<Region> windows_of(const std::vector<float>& weights, std::int32_t width);

} // namespace obscura::serve::compatible
