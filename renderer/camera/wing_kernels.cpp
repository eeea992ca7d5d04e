// SPDX-License-Identifier: Apache-2.0
#include "renderer/camera/wing_kernels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

using std::numbers::pi;

/// Radii of a level, in its cells: fade-in from 4 to 8, of the level above from 8 to 16. Level 0 begins with
/// the wings themselves.
constexpr double fade_in_cells = 4;
constexpr double outer_cells = 4 * fade_in_cells;
/// Nodes of the periodic grid on which the kernels are computed.
constexpr std::int32_t period = 64;
constexpr std::int32_t aliases = 1; ///< on either side
constexpr std::size_t radii = 2048, frequencies = 768;
/// Largest wave number, in radians per cell, of the periodic grid and its aliases.
constexpr double max_frequency = (2 * aliases + 1) * pi * std::numbers::sqrt2 * 1.01;

/// Fraction of the wings at a radius, in cells of the level that fades in, which belongs to that level and
/// those above.
double fade_in(double radius_cells) {
    const double t = std::clamp(std::log2(radius_cells / fade_in_cells), 0.0, 1.0);
    return t * t * t * (10 - 15 * t + 6 * t * t);
}

/// Hankel transform of order 0 of functions of a radius in [0, outer_cells].
class HankelTransform {
public:
    HankelTransform() : bessel_((frequencies + 3) * radii) {
        for (std::size_t k = 0; k < frequencies + 3; ++k)
            for (std::size_t r = 0; r < radii; ++r)
                bessel_[k * radii + r] = static_cast<float>(::j0(frequency(k) * radius(r)) * radius(r));
    }
    static double radius(std::size_t r) { return (static_cast<double>(r) + 0.5) * outer_cells / radii; }
    /// Two-dimensional Fourier transform, at frequency(k), of the values at radius(r).
    [[nodiscard]] std::vector<double> of(const std::vector<double>& values) const {
        std::vector<double> out;
        for (std::size_t k = 0; k < frequencies + 3; ++k) {
            double sum = 0;
            for (std::size_t r = 0; r < radii; ++r)
                sum += values[r] * static_cast<double>(bessel_[k * radii + r]);
            out.push_back(sum * 2 * pi * outer_cells / radii);
        }
        return out;
    }
    /// Cubic interpolation in a transform, which is even.
    static double at(const std::vector<double>& transform, double wave_number) {
        const double position = wave_number / max_frequency * frequencies;
        const auto i = std::min(static_cast<std::size_t>(position), frequencies);
        const double t = position - static_cast<double>(i);
        const double before = transform[i > 0 ? i - 1 : 1];
        const double* v = transform.data() + i;
        return v[0] +
               t / 2 *
                   (v[1] - before +
                    t * (2 * before - 5 * v[0] + 4 * v[1] - v[2] + t * (3 * (v[0] - v[1]) + v[2] - before)));
    }

private:
    static double frequency(std::size_t k) { return static_cast<double>(k) * max_frequency / frequencies; }

    std::vector<float> bessel_; ///< times the radius
};

/// Transfer functions of the grid along one axis, by node of its spectrum.
struct Axis {
    std::array<std::array<double, 2 * aliases + 1>, period> wave_number{}, weight{};
    std::array<double, period> norm{};

    Axis() {
        for (std::size_t n = 0; n < period; ++n) {
            const double base =
                2 * pi * (n < period / 2 ? static_cast<double>(n) : static_cast<double>(n) - period) / period;
            double deposited = 0;
            double interpolated = 0;
            for (std::size_t m = 0; m <= 2 * aliases; ++m) {
                const double k = base + 2 * pi * (static_cast<double>(m) - aliases);
                const double sinc = k == 0 ? 1 : std::sin(k / 2) / (k / 2);
                const double linear = sinc * sinc;
                const double cubic = linear * linear;
                wave_number[n][m] = k;
                weight[n][m] = linear * cubic;
                deposited += linear * linear;
                interpolated += cubic * cubic;
            }
            norm[n] = deposited * interpolated;
        }
    }
};

/// The optimal kernel for a transform in units of cells.
std::vector<float> kernel_of(const Axis& axis, const std::vector<double>& transform) {
    constexpr std::size_t n = period;
    std::vector<double> spectrum(n * n);
    for (std::size_t j = 0; j < n; ++j)
        for (std::size_t i = 0; i < n; ++i) {
            double sum = 0;
            for (std::size_t b = 0; b <= 2 * aliases; ++b)
                for (std::size_t a = 0; a <= 2 * aliases; ++a) {
                    const double x = axis.wave_number[i][a];
                    const double y = axis.wave_number[j][b];
                    sum += axis.weight[i][a] * axis.weight[j][b] *
                           HankelTransform::at(transform, std::sqrt(x * x + y * y));
                }
            spectrum[j * n + i] = sum / (axis.norm[i] * axis.norm[j]);
        }
    // The inverse transform of an even spectrum, one axis after the other.
    std::array<double, period> cosine{};
    for (std::size_t i = 0; i < n; ++i)
        cosine[i] = std::cos(2 * pi * static_cast<double>(i) / n);
    const auto along_rows = [&](const std::vector<double>& from) {
        std::vector<double> out(n * n);
        for (std::size_t j = 0; j < n; ++j)
            for (std::size_t i = 0; i < n; ++i) {
                double sum = 0;
                for (std::size_t k = 0; k < n; ++k)
                    sum += from[j * n + k] * cosine[i * k % n];
                out[i * n + j] = sum / n; // transposed
            }
        return out;
    };
    const std::vector<double> whole = along_rows(along_rows(spectrum));
    constexpr std::int32_t reach = WingKernels::reach;
    constexpr double most2 = (reach + 0.5) * (reach + 0.5);
    std::vector<double> kernel;
    double sum = 0;
    for (std::int32_t j = -reach; j <= reach; ++j)
        for (std::int32_t i = -reach; i <= reach; ++i) {
            const auto at = static_cast<std::size_t>((j + period) % period * period + (i + period) % period);
            kernel.push_back(i * i + j * j <= most2 ? whole[at] : 0);
            sum += kernel.back();
        }
    // What lies beyond the reach belongs to the flux.
    std::vector<float> out;
    for (const double v : kernel)
        out.push_back(static_cast<float>(sum > 0 ? v * std::max(0.0, transform[0]) / sum : 0.0));
    return out;
}

} // namespace

WingKernels::WingKernels(const Psf& psf, std::size_t channels) : zones_(psf.zones()), channels_(channels) {
    // The wings begin at half the core, two cells or more from their source.
    cell_px_ = std::exp2(std::floor(std::log2(psf.core_px() / 4)));
    const HankelTransform hankel;
    const Axis axis;
    for (std::size_t level = 0; level == 0 || outer_cells * cell_px(level - 1) < psf.wings_px(); ++level) {
        const double cell = cell_px(level);
        const bool last = outer_cells * cell >= psf.wings_px();
        std::vector<std::vector<float>>& kernels = kernels_.emplace_back();
        for (std::size_t zone = 0; zone < zones_; ++zone)
            for (std::size_t c = 0; c < channels_; ++c) {
                std::vector<double> values;
                for (std::size_t r = 0; r < radii; ++r) {
                    const double cells = HankelTransform::radius(r);
                    const double from = level == 0 ? 1 : fade_in(cells);
                    const double to = last ? 0 : fade_in(cells / 2);
                    values.push_back(psf.wing(zone, c, cells * cells * cell * cell) * (from - to));
                }
                kernels.push_back(kernel_of(axis, hankel.of(values)));
            }
    }
}

} // namespace obscura::renderer
