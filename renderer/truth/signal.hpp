// SPDX-License-Identifier: Apache-2.0
// Brightest pixel and noise of the image of a point, from the PSF and the length of its streak.
#pragma once

#include "renderer/truth/row_states.hpp"
#include "renderer/truth/scene_truth.hpp"

namespace obscura::renderer {

/// Image of a point: shares of its light.
struct PointImage {
    double peak_share = 1; ///< in the brightest pixel
    double area_px = 1;    ///< noise-equivalent area, 1 / sum of the squared shares
};

/// Image of a point at `at` on the sensor (without the shift of the PSF). `streak`: from the first to the
/// last position of the point; the peak is that in its middle, the area grows as the peak falls.
[[nodiscard]] PointImage image_of_point(const TruthScene& scene, ImagePoint at, ImagePoint streak,
                                        std::span<const double> band_weights);

/// Fills signal_e, peak_e, snr and saturated of an entry. `signal_e`: expected electrons.
void set_signal(TruthEntry& entry, const TruthDetector& detector, double signal_e, const PointImage& image);

} // namespace obscura::renderer
