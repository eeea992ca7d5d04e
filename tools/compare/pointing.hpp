// SPDX-License-Identifier: Apache-2.0
// Pointing fit: the rotation of the camera that aligns a rendered image with a flight image; I/F.
#pragma once

#include "core/geometry.hpp"
#include "images/image.hpp"
#include "renderer/camera/projection.hpp"

#include <cstdint>

namespace obscura::tools {

/// Rotation of a camera about its own axes. Positive angles turn the boresight right, the boresight down, and
/// the image axis right towards down.
struct Pointing {
    double right_rad = 0, down_rad = 0, roll_rad = 0;

    /// Rotation of vectors from the turned camera's frame to the frame of the camera before the turn.
    [[nodiscard]] Quat turn() const;
};

struct PointingFit {
    Pointing pointing;
    /// Standard errors; infinite where the correlation has no maximum in the search range, and all of them
    /// where an angle ends at its limit, beside which the others are not the best ones.
    Pointing error;
    std::int32_t limit_px = 0; ///< largest shift that was searched for, see Agreement
    /// Whether each angle ends at its limit, so that the best one may lie beyond; not if its limit is 0.
    bool right_at_limit = false, down_at_limit = false, roll_at_limit = false;
    double correlation = 0; ///< of the smoothed images at the fitted pointing

    [[nodiscard]] bool at_limit() const { return right_at_limit || down_at_limit || roll_at_limit; }
};

struct PointingSettings {
    std::int32_t max_shift_px = 8;
    double max_roll_rad = 0.02;
};

/// `image` as the camera sees it after `pointing`: exact for scenes of any depth, as the camera does not
/// move. NaN outside. `lens` is that of the camera, whose sensor the image covers.
[[nodiscard]] images::Image turned(const images::Image& image, const renderer::Projection& lens,
                                   const Pointing& pointing);

/// The pointing that maximises the correlation of turned(`image`) with `reference`. Rolls and whole shifts
/// are searched first, then all three angles by Newton's method; each image is turned by half of the angle,
/// and the standard errors are those of compare_images(). Throws InputError as compare_images() does.
[[nodiscard]] PointingFit fit_pointing(const images::Image& reference, const images::Image& image,
                                       const renderer::Projection& lens, const PointingSettings& settings);

/// I/F of a rendered image: pi times the radiance over the Sun's irradiance `sun_w_m2` at the target.
/// `values` are irradiances of pixels, W/m2, or with `radiance` radiances, W m-2 sr-1.
[[nodiscard]] images::Image i_over_f(const images::Image& values, const renderer::Projection& lens,
                                     bool radiance, double sun_w_m2);

} // namespace obscura::tools
