// SPDX-License-Identifier: Apache-2.0
// Truth table of a frame from the scene: stars, bodies, limbs, terminators and landmarks in its pixels.
#pragma once

#include "core/camera/frame.hpp"
#include "core/camera/scene_truth.hpp"
#include "renderer/pixel_times.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace obscura::renderer {

struct TruthScene;

/// Detector, for the expected signal.
struct TruthDetector {
    /// Electrons per second and W/m2 at the entrance pupil, for each spectral band; empty: no detector.
    std::span<const double> electrons_per_s_per_w_m2;
    double dark_e_per_s = 0;
    double noise_e = 0;      ///< rms of a pixel without light and dark current
    double saturation_e = 0; ///< full well, or the end of the ADC's range if that comes first
};

/// Frame whose truth is wanted.
struct TruthRequest {
    std::span<const FrameWindow> windows; ///< of the composed image
    std::span<const RowTime> rows;        ///< of the composed image, scene time
    /// The same rows by the clock of the table, which exposures are measured by; empty: `rows`.
    std::span<const RowTime> row_times{};
    bool push_broom = false; ///< every row is the first row of its window
    /// Times of the pixels of each window, where they have their own (scene time); else empty.
    std::span<const PixelTimes> pixel_times{};
    std::uint64_t frame_id = 0;
    TruthDetector detector{};
    /// Points of each limb and terminator; 0: none.
    std::uint32_t curve_points = 72;
    /// Craters and boulders of terrains, of which the tiles are needed.
    bool features = true;
    bool body_light = true; ///< irradiance and signal of bodies, for which rays are traced
    /// Further entries are only counted; 0: no limit.
    std::size_t max_entries = 0;
    /// Memory to work in, before the heap: for threads that must not use that.
    std::span<std::byte> workspace{};
};

/// Replaces the contents of `truth`. Every body and landmark has an entry in each window where it is seen or
/// hidden, and else one as `outside`; stars and curves have entries only for points on delivered pixels.
/// Allocates where workspace or vectors of `truth` are too small.
void list_truth(const TruthScene& scene, const TruthRequest& request, SceneTruth& truth);

} // namespace obscura::renderer
