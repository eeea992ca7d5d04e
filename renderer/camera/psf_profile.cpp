// SPDX-License-Identifier: Apache-2.0
#include "renderer/camera/psf_profile.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace obscura::renderer {
namespace {

using std::numbers::pi;

/// 2 J1(x) / x.
double jinc(double x) {
    return x < 1e-4 ? 1 - x * x / 8 : 2 * std::cyl_bessel_j(1, x) / x;
}

/// exp(-x) I0(x).
double scaled_i0(double x) {
    if (x < 30) return std::exp(-x) * std::cyl_bessel_i(0, x);
    return (1 + (1.0 / 8 + (9.0 / 128 + 225.0 / 3072 / x) / x) / x) / std::sqrt(2 * pi * x);
}

/// Light per px^2 in the middle of the pattern without defocus.
double peak_value(const Aperture& a, double wavelength_m) {
    const double scale = a.pitch_m / (wavelength_m * a.f_number);
    return pi / 4 * (1 - a.obscuration * a.obscuration) * scale * scale;
}

} // namespace

double PsfProfile::at(double radius_px) const {
    const double position = radius_px / step_px;
    const auto i = static_cast<std::size_t>(position);
    if (i + 1 >= values.size()) return 0;
    return values[i] + (values[i + 1] - values[i]) * (position - static_cast<double>(i));
}

double airy_psf(const Aperture& a, double wavelength_m, double radius_px) {
    const double v = pi * radius_px * a.pitch_m / (wavelength_m * a.f_number);
    const double e2 = a.obscuration * a.obscuration;
    const double amplitude = (jinc(v) - e2 * jinc(a.obscuration * v)) / (1 - e2);
    return peak_value(a, wavelength_m) * amplitude * amplitude;
}

double defocused_psf(const Aperture& a, double wavelength_m, double defocus_m, double radius_px) {
    const double v = pi * radius_px * a.pitch_m / (wavelength_m * a.f_number);
    const double phase = pi * defocus_m / (4 * wavelength_m * a.f_number * a.f_number);
    const double from = a.obscuration * a.obscuration;
    // Simpson's rule in the square of the pupil's radius, many points to each turn of the integrand.
    const int intervals = 2 * (16 + static_cast<int>(2 * (v + std::abs(phase))));
    std::complex<double> sum = 0;
    for (int i = 0; i <= intervals; ++i) {
        const double s = from + (1 - from) * i / intervals;
        const double weight = i == 0 || i == intervals ? 1 : i % 2 == 1 ? 4 : 2;
        sum += weight * std::polar(std::cyl_bessel_j(0, v * std::sqrt(s)), phase * s);
    }
    return peak_value(a, wavelength_m) * std::norm(sum / (3.0 * intervals));
}

double blurred_annulus_psf(double inner_px, double outer_px, double sigma_px, double radius_px) {
    // A ring of radius s seen through the Gaussian: Rice's distribution.
    constexpr int intervals = 200;
    const double variance = sigma_px * sigma_px;
    // Only rings within reach of the Gaussian count.
    const double from = std::clamp(radius_px - 8 * sigma_px, inner_px, outer_px);
    const double to = std::clamp(radius_px + 8 * sigma_px, inner_px, outer_px);
    double sum = 0;
    for (int i = 0; i <= intervals; ++i) {
        const double s = from + (to - from) * i / intervals;
        const double weight = i == 0 || i == intervals ? 1 : i % 2 == 1 ? 4 : 2;
        const double d = radius_px - s;
        sum += weight * s * std::exp(-d * d / (2 * variance)) * scaled_i0(radius_px * s / variance);
    }
    const double ring = 2 * (to - from) / (3 * intervals) * sum;
    return ring / (outer_px * outer_px - inner_px * inner_px) / (2 * pi * variance);
}

} // namespace obscura::renderer
