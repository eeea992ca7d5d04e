// SPDX-License-Identifier: Apache-2.0
// SIMD kernels of the detector over one row of pixels, dispatched by instruction set at run time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace obscura::sensors::kernels {

/// Rows are padded: every row buffer given to a kernel must be readable and writable this many elements
/// beyond its end, and aligned as operator new aligns.
constexpr std::size_t padding = 64;

/// Philox counter and key of a row of random numbers. The pixel word of the counter is `first_pixel` plus the
/// index in the row; the low half of the last word counts attempts of the rejection sampler.
struct Stream {
    std::uint32_t first_pixel = 0;
    std::uint32_t frame_low = 0;
    std::uint32_t effect = 0;
    std::uint32_t frame_high = 0; ///< low 16 bits are used
    std::array<std::uint32_t, 2> key{};
};

/// out[i] = scale * values[i] * response[i] (response null: 1), or adds it if `add`; negative values and NaN
/// count as 0.
void light_row(const float* values, const float* response, float scale, bool add, std::size_t n, float* out);

/// out = 3x3 kernel (centre 1 - 4 edge - 4 corner) over the rows above, here and below. The three rows need
/// one valid element on either side.
void crosstalk_row(const float* above, const float* here, const float* below, float edge, float corner,
                   std::size_t n, float* out);

/// out[i] = light[i] * response[i] * light_scale + dark[i] * dark_scale (response null: 1; dark null:
/// dark_scale), never below 0.
void mean_row(const float* light, const float* response, float light_scale, const float* dark,
              float dark_scale, std::size_t n, float* out);

/// Draws counts[i] from Poisson(mean[i]) and two standard normals z0[i], z1[i] beside it. `scratch` holds
/// 4 * (n + padding) elements. Means below 64 by inversion with a table, above by transformed rejection with
/// squeeze (W. Hoermann, Insurance: Mathematics and Economics 12 (1993), algorithm PTRS): exact up to single
/// precision. Means above 4e6 count as 4e6.
void poisson_row(const float* mean, std::size_t n, const Stream& stream, float* counts, float* z0, float* z1,
                 float* scratch);

/// Two standard normals per pixel.
void normal_row(std::size_t n, const Stream& stream, float* z0, float* z1);

/// Draws shot noise and Gaussian noise of `variance` together, for variances from 400 (20 e- rms): a
/// Cornish-Fisher expansion with the mean, variance and third moment of Poisson(mean[i]) plus the Gaussian.
/// Its largest distance from their distribution function is below 2e-5 at 20 e- and 1e-6 at 55 e-. Costs a
/// quarter of poisson_row(). `z` is scratch; `z` and `out` must also be writable `padding` elements before
/// their beginning.
void merged_row(const float* mean, float variance, std::size_t n, const Stream& stream, float* out, float* z);

/// out[i] = exp(x[i]) for |x| <= 80.
void exp_row(const float* x, std::size_t n, float* out);

/// Signal chain from charge to digital number.
struct Chain {
    float full_well_e = 0;
    float inverse_full_well = 0;
    std::array<float, 4> nonlinearity{}; ///< S = N (1 - c1 x - c2 x^2 - ...), x = N / full well
    float offset_scale = 0;              ///< 0 or 1: fixed pattern of the offset
    float sigma0_e = 0, sigma1_e = 0;    ///< of z0 and z1
    float row_e = 0;                     ///< common to the row
    float gain_dn_per_e = 0;
    float black_dn = 0;
    float top_dn = 0;
    const std::uint16_t* adc = nullptr; ///< codes in steps of 1/adc_steps DN; null: ideal converter
    float adc_steps = 0;
};

/// charge[i] = min(charge[i], full well), then the non-linearity is applied.
void collect_row(const Chain& chain, std::size_t n, float* charge);

/// Whether any of values[i] is above `limit`.
[[nodiscard]] bool any_above(const float* values, float limit, std::size_t n);

/// charge[i] += lag * memory[i]; then memory[i] = min(charge[i], full well).
void lag_row(float lag, float full_well_e, std::size_t n, float* charge, float* memory);

/// Adds weight * signal[i] to sum[i].
void accumulate_row(const float* signal, float weight, std::size_t n, float* sum);

/// Adds noise and offset to the signal, applies the gain and converts. `offset`, `z0` and `z1` may be null.
void convert_row(const Chain& chain, const float* signal, const float* offset, const float* z0,
                 const float* z1, std::size_t n, std::uint16_t* dn);

} // namespace obscura::sensors::kernels
