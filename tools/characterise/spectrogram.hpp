// SPDX-License-Identifier: Apache-2.0
// Spectrograms of fixed patterns after EMVA 1288: amplitude against spatial frequency along rows or columns.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace obscura::tools {

/// Root mean square over all rows (`along_rows`) or columns of the amplitude spectrum of `values` (row-major,
/// `width` columns): (frequency in cycles per pixel, amplitude), from 1 / length to 1/2. White noise of
/// standard deviation s has the amplitude s at every frequency. The mean of each line is removed by leaving
/// out frequency 0.
[[nodiscard]] std::vector<std::pair<double, double>> spectrogram(const std::vector<double>& values,
                                                                 std::size_t width, bool along_rows);

} // namespace obscura::tools
