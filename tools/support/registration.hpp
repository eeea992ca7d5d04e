// How well two images agree: sub-pixel shift, brightness scale, correlation, residual.
#pragma once

#include "images/image.hpp"

#include <cstdint>

namespace obscura::tools {

using images::Image;

struct Agreement {
    double shift_x_px = 0,
           shift_y_px = 0;  ///< image(x + shift_x, y + shift_y) shows what reference(x, y) shows
    double correlation = 0; ///< Pearson's, at that shift
    double correlation_unshifted = 0;
    double scale = 1, offset = 0; ///< image = scale * reference + offset, least squares at the shift
    double residual_rms = 0;      ///< of image - scale * reference - offset
    double image_rms = 0;         ///< of the image over the same pixels
    std::int64_t pixels = 0;      ///< compared ones: inside both, not NaN in either
    /// Standard errors of the shift; infinite where the correlation has no maximum within the search (it
    /// still rises at its border, or the images do not change in that direction).
    double error_x_px = 0, error_y_px = 0;
};

struct RegistrationSettings {
    std::int32_t max_shift_px = 8; ///< searched in each direction
    bool with_offset = true;       ///< false: image = scale * reference
};

/// Registers `image` to `reference` (same size). The integer shift of the highest correlation is searched
/// from coarse to fine over image pyramids; then the correlation as a function of the shift is maximised
/// under a Gaussian of one pixel, each image shifted by half of it with cubic convolution (Keys 1981), so
/// that both are smoothed alike at any shift. The standard errors are those of an M-estimator (sandwich form,
/// White 1982) from how far the blocks of an 8 x 8 grid pull apart, so that differences that hang together
/// over many pixels (another shape, other shading) count for what they are: a shift of several times its
/// error is real, one below it is not. Throws InputError when the sizes differ, nothing overlaps or an image
/// is flat.
[[nodiscard]] Agreement compare_images(const Image& reference, const Image& image,
                                       const RegistrationSettings& settings);

/// image - scale * reference - offset at the shift, on the reference's grid; NaN outside.
[[nodiscard]] Image residual_image(const Image& reference, const Image& image, const Agreement& agreement);

/// Mean-of-block disagreement: |mean image - scale * mean reference - offset| over the mean of the scaled
/// reference, per block of `size` x `size` pixels at shift 0; blocks with a reference mean below `floor` of
/// the brightest block's are left out.
struct BlockDisagreement {
    double worst = 0, median = 0;
    std::int64_t blocks = 0;
};
[[nodiscard]] BlockDisagreement compare_blocks(const Image& reference, const Image& image,
                                               const Agreement& agreement, std::int32_t size, double floor);

} // namespace obscura::tools
