// SPDX-License-Identifier: Apache-2.0
// Estimated error of sparse grids against what interpolation does to edges, noise and curved light.
#include "renderer/integrators/sparse_grid.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

namespace sparse_grid_test {

using namespace obscura;
using namespace obscura::renderer;

namespace {

constexpr std::int32_t size = 256;

/// Estimated over true root mean square of the error of a grid over an image.
double ratio_of(std::int32_t step, double response_px, const std::function<double(double, double)>& point,
                const std::function<double(double, double)>& pixel, std::uint64_t frames = 16) {
    double told = 0, error2 = 0;
    for (std::uint64_t f = 0; f < frames; ++f) {
        SparseGrid grid;
        grid.reset(step, 0, size, 0, size, 1, response_px, 1, f);
        for (std::int32_t r = 0; r < grid.rows(); ++r)
            for (std::int32_t c = 0; c < grid.columns(); ++c)
                grid.row(r)[c] = static_cast<float>(point(grid.x_of(c), grid.y_of(r)));
        for (std::int32_t r = 1; r + 1 < grid.rows(); ++r)
            grid.estimate(r, 1);
        std::vector<double> row(size), variance(size);
        for (std::int32_t y = 0; y < size; ++y) {
            grid.interpolate(0, 0, y, row);
            grid.variance(0, y, variance);
            for (std::int32_t x = 0; x < size; ++x) {
                error2 += std::pow(row[static_cast<std::size_t>(x)] - pixel(x, y), 2);
                told += variance[static_cast<std::size_t>(x)];
            }
        }
    }
    return std::sqrt(told / error2);
}

double blurred(double distance, double sigma) {
    return 0.5 * std::erfc(-distance / (sigma * std::sqrt(2.0)));
}

} // namespace

TEST_CASE("the error of edges across and along the rows of a sparse grid is known, for any response") {
    // Rising and falling, farther apart than a window.
    const auto edges = [](double x, const std::function<double(double)>& edge) {
        double sum = 0;
        for (int k = 0; k < 4; ++k)
            sum += (k % 2 == 0 ? 1 : -1) * edge(x - (30.3 + 61.7 * k));
        return sum;
    };
    for (const std::int32_t step : {1, 2, 4})
        for (const double response : {0.5, 0.6, 0.75, 0.9}) {
            const auto sharp = [&](double at) {
                return edges(at, [](double d) { return d > 0 ? 1.0 : 0.0; });
            };
            const auto seen = [&](double at) {
                return edges(at, [&](double d) { return blurred(d, response); });
            };
            const double across = ratio_of(
                step, response, [&](double x, double) { return sharp(x); },
                [&](double x, double) { return seen(x); }, 64);
            const double along = ratio_of(
                step, response, [&](double, double y) { return sharp(y); },
                [&](double, double y) { return seen(y); }, 64);
            const double oblique = ratio_of(
                step, response, [&](double x, double y) { return sharp((x + y) / std::sqrt(2.0)); },
                [&](double x, double y) { return seen((x + y) / std::sqrt(2.0)); }, 16);
            INFO("points " << step << " px apart, response " << response << " px: " << across << " across, "
                           << along << " along, " << oblique << " oblique");
            CHECK(std::min({across, along, oblique}) > 0.75);
            CHECK(std::max({across, along, oblique}) < 1.25);
        }
}

TEST_CASE("the error of noise and of curved light in a sparse grid is known") {
    std::mt19937 random(5);
    std::normal_distribution<double> noise(0, 1);
    for (const std::int32_t step : {2, 4}) {
        const double noisy = ratio_of(
            step, 0.6, [&](double, double) { return 10 + noise(random); },
            [](double, double) { return 10.0; });
        INFO("points " << step << " px apart: " << noisy);
        CHECK(noisy > 0.9);
        CHECK(noisy < 1.1);
        // Independent curvatures along the axes, on average over their signs.
        const auto curved = [&](double down) {
            const auto light = [down](double x, double y) {
                return 1e-4 * (std::pow(x - 100, 2) + down * std::pow(y - 120, 2));
            };
            return ratio_of(step, 0.6, light, light, 4);
        };
        const double like = curved(1), unlike = curved(-1);
        INFO("curved light: " << like << " and " << unlike);
        CHECK(std::sqrt(2 / (1 / (like * like) + 1 / (unlike * unlike))) > 0.9);
        CHECK(std::sqrt(2 / (1 / (like * like) + 1 / (unlike * unlike))) < 1.1);
    }
}

} // namespace sparse_grid_test
