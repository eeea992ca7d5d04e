// SPDX-License-Identifier: Apache-2.0
// Image registration: sub-pixel shift, brightness scale and offset, correlation and residual of two images.
#pragma once

#include "images/image.hpp"

#include <cstdint>

namespace obscura::tools {

using images::Image;

struct Agreement {
    /// image(x + shift_x, y + shift_y) corresponds to reference(x, y).
    double shift_x_px = 0, shift_y_px = 0;
    double correlation = 0; ///< Pearson correlation at the shift
    double correlation_unshifted = 0;
    /// image = scale * reference + offset, least squares at the shift.
    double scale = 1, offset = 0;
    double residual_rms = 0; ///< rms of image - scale * reference - offset
    double image_rms = 0;    ///< rms of the image over the same pixels
    std::int64_t pixels = 0; ///< pixels compared: inside both images, NaN in neither
    /// Largest shift that was searched for; less than the setting where the images are smaller.
    std::int32_t limit_px = 0;
    /// Whether the shift ends at that limit, so that the best one may lie beyond.
    bool at_limit_x = false, at_limit_y = false;
    /// Standard errors of the shift; infinite where the correlation has no maximum within the search range
    /// (either shift ends at the limit, or the images are constant in that direction).
    double error_x_px = 0, error_y_px = 0;
};

struct RegistrationSettings {
    std::int32_t max_shift_px = 8; ///< search range in each direction
    bool with_offset = true;       ///< false: image = scale * reference
    bool sub_pixel = true;         ///< false: whole shifts only, without standard errors
};

/// Registers `image` to `reference` (same size). First the integer shift of the highest correlation is
/// searched from coarse to fine over image pyramids. Then the correlation of the images, smoothed by a
/// Gaussian of one pixel, is maximised over the sub-pixel shift; each image is shifted by half of it with
/// cubic convolution (Keys 1981), so that both are smoothed alike at any shift. Standard errors contain what
/// the images do not share besides noise (other texture, shape or shading; fit_variances()): a shift of
/// several standard errors is significant. Throws InputError if the sizes differ, nothing overlaps or an
/// image is flat.
[[nodiscard]] Agreement compare_images(const Image& reference, const Image& image,
                                       const RegistrationSettings& settings);

/// Residual image - scale * reference - offset at the shift, on the reference's grid; NaN outside.
[[nodiscard]] Image residual_image(const Image& reference, const Image& image, const Agreement& agreement);

/// Relative difference of block means: |mean image - scale * mean reference - offset| over the mean of the
/// scaled reference.
struct BlockDisagreement {
    double worst = 0, median = 0;
    std::int64_t blocks = 0;
};
/// Compares blocks of `size` x `size` pixels at shift 0. Blocks with a reference mean below `floor` times
/// that of the brightest block are left out.
[[nodiscard]] BlockDisagreement compare_blocks(const Image& reference, const Image& image,
                                               const Agreement& agreement, std::int32_t size, double floor);

} // namespace obscura::tools
