// SPDX-License-Identifier: Apache-2.0
// Intrinsic parameters of a camera.
#pragma once

#include <array>

namespace obscura {

/// Intrinsic parameters of a camera: right, down. Projections other than the pinhole's, distortion and the
/// rotation of the sensor are not in them.
struct Intrinsics {
    std::array<double, 2> focal_length_px{};    ///< fx, fy: focal length over the pitch
    std::array<double, 2> principal_point_px{}; ///< on the sensor; pixel centres at integers
    std::array<double, 2> pixel_pitch_m{};
};

} // namespace obscura
