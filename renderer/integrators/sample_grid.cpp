// SPDX-License-Identifier: Apache-2.0
#include "renderer/integrators/sample_grid.hpp"

#include "core/philox.hpp"
#include "renderer/packets/sampler.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::renderer {
namespace {

/// Kernel radius in standard deviations of the PSF; the weights within are normalised.
constexpr double wide_sigmas = 4;

/// A narrower PSF would show the grid's shift: it moves a slope by 2/pi exp(-2 pi^2 sigma^2) px at most.
constexpr double min_sigma_px = 0.4;
/// The kernel of a wider one would reach beyond the points that roughness() covers.
constexpr double max_sigma_px = 0.75;

double reach_of(const GaussianPsf& psf) {
    return std::ceil(0.5 + wide_sigmas * std::max(psf.x.sigma_px(), psf.y.sigma_px()));
}

OBSCURA_VECTOR_CLONES
void add_row(const float* from, double weight, int count, double* sum) {
    for (int i = 0; i < count; ++i)
        sum[i] += weight * static_cast<double>(from[i]);
}

OBSCURA_VECTOR_CLONES
void add_column(const double* from, double weight, Doubles& sum) {
    for (int i = 0; i < packet_size; ++i)
        sum.v[i] += weight * from[i];
}

/// Least squares and second differences over three rows of 18 points: see SampleGrid::roughness().
OBSCURA_VECTOR_CLONES
void fit_planes(const double (&points)[3][packet_size + 2], GridRoughness& rough) {
    for (int i = 0; i < packet_size; ++i) {
        const double middle = points[1][i + 1];
        double sum = 0;
        double squares = 0;
        double right = 0;
        double down = 0;
        double bend = 0;
        for (int r = 0; r < 3; ++r)
            for (int k = 0; k < 3; ++k) {
                const double d = points[r][i + k] - middle;
                sum += d;
                squares += d * d;
                right += (k - 1) * d;
                down += (r - 1) * d;
                bend += (r == 1 ? -2.0 : 1.0) * (k == 1 ? -2.0 : 1.0) * d;
            }
        const double spread = squares - sum * sum / 9;
        const double rest = spread - (right * right + down * down) / 6;
        rough.deviation.v[i] = std::sqrt((spread > 0 ? spread : 0.0) / 8);
        rough.residual.v[i] = std::sqrt((rest > 0 ? rest : 0.0) / 6);
        rough.noise2.v[i] = bend * bend / 36;
    }
}

} // namespace

bool SampleGridKernel::fits(const GaussianPsf& psf) {
    const auto good = [](const GaussianAxis& axis) {
        return axis.sigma_px() >= min_sigma_px && axis.sigma_px() <= max_sigma_px;
    };
    return good(psf.x) && good(psf.y);
}

SampleGridKernel::SampleGridKernel(const GaussianPsf& psf, std::uint64_t seed, std::uint64_t frame_id) {
    if (!fits(psf)) return;
    const SeedWords random = seed_words(seed, frame_id, SamplePurpose::sample_grid, 0, 0);
    shift_x = uniform_double(random[0]) - 0.5;
    shift_y = uniform_double(random[1]) - 0.5;
    reach = static_cast<std::int32_t>(reach_of(psf));
    double squares[2] = {};
    const auto fill = [&](const GaussianAxis& axis, double shift, double* weights, double& square) {
        double sum = 0;
        for (std::int32_t k = -reach; k <= reach; ++k)
            sum += weights[k + reach] = axis.weight(k + shift, 0);
        for (std::int32_t k = 0; k <= 2 * reach; ++k) {
            weights[k] /= sum;
            square += weights[k] * weights[k];
        }
    };
    fill(psf.x, shift_x, x, squares[0]);
    fill(psf.y, shift_y, y, squares[1]);
    noise = std::sqrt(std::max(squares[0], squares[1]));
    independent = squares[0] * squares[1];
}

void SampleGrid::reset(const Region& window, std::int32_t first_row, std::int32_t rows, std::size_t channels,
                       std::int32_t reach) {
    const auto floor_block = [](std::int32_t x) {
        return (x >= 0 ? x / packet_size : -((-x + packet_size - 1) / packet_size)) * packet_size;
    };
    // One more than the kernel's reach, for roughness() of a PSF without any.
    const std::int32_t margin = std::max(reach, 1);
    first_x_ = floor_block(window.x) - (margin + packet_size - 1) / packet_size * packet_size;
    const std::int32_t end = floor_block(window.x + window.width - 1) + packet_size +
                             (margin + packet_size - 1) / packet_size * packet_size;
    width_ = end - first_x_;
    first_y_ = window.y + first_row - margin;
    height_ = rows + 2 * margin;
    near_.assign(static_cast<std::size_t>(width_ / packet_size * height_), {});
    values_.assign(channels * static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), 0.0F);
}

void SampleGrid::gather(const SampleGridKernel& kernel, std::size_t channel, std::int32_t x, std::int32_t y,
                        Doubles& value) const {
    const int count = packet_size + 2 * kernel.reach;
    double column[packet_size + 2 * SampleGridKernel::max_reach] = {};
    for (std::int32_t k = -kernel.reach; k <= kernel.reach; ++k)
        add_row(row(channel, y + k) + (x - kernel.reach - first_x_), kernel.y[k + kernel.reach], count,
                column);
    for (double& v : value.v)
        v = 0;
    for (std::int32_t k = 0; k <= 2 * kernel.reach; ++k)
        add_column(column + k, kernel.x[k], value);
}

GridRoughness SampleGrid::roughness(std::size_t channels, std::int32_t x, std::int32_t y) const {
    double points[3][packet_size + 2] = {};
    const double share = 1 / static_cast<double>(channels);
    for (int r = 0; r < 3; ++r)
        for (std::size_t c = 0; c < channels; ++c)
            add_row(row(c, y + r - 1) + (x - 1 - first_x_), share, packet_size + 2, points[r]);
    GridRoughness rough;
    fit_planes(points, rough);
    return rough;
}

} // namespace obscura::renderer
