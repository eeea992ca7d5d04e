// SPDX-License-Identifier: Apache-2.0
#include "tools/compare/registration.hpp"

#include "core/error.hpp"
#include "tools/compare/registration_error.hpp"
#include "tools/compare/registration_math.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

namespace obscura::tools {
namespace {

Image halved(const Image& image) {
    Image out{image.width / 2, image.height / 2, {}};
    out.values.reserve(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height));
    for (std::int32_t y = 0; y < out.height; ++y)
        for (std::int32_t x = 0; x < out.width; ++x)
            out.values.push_back(0.25 * (image.at(2 * x, 2 * y) + image.at(2 * x + 1, 2 * y) +
                                         image.at(2 * x, 2 * y + 1) + image.at(2 * x + 1, 2 * y + 1)));
    return out;
}

struct Shift {
    std::int32_t x = 0, y = 0;
};

double correlation_at(const Image& reference, const Image& image, Shift shift) {
    RegressionSums sums;
    const std::int32_t x0 = std::max(0, -shift.x), x1 = std::min(reference.width, reference.width - shift.x);
    const std::int32_t y0 = std::max(0, -shift.y),
                       y1 = std::min(reference.height, reference.height - shift.y);
    for (std::int32_t y = y0; y < y1; ++y)
        for (std::int32_t x = x0; x < x1; ++x) {
            const double a = reference.at(x, y), b = image.at(x + shift.x, y + shift.y);
            if (!std::isnan(a + b)) sums.add(a, b);
        }
    return sums.correlation();
}

/// Integer shift of the highest correlation within `radius` of `around` and within `limit`.
Shift search(const Image& reference, const Image& image, Shift around, std::int32_t radius,
             std::int32_t limit) {
    Shift best = around;
    double highest = -2;
    for (std::int32_t dy = -radius; dy <= radius; ++dy)
        for (std::int32_t dx = -radius; dx <= radius; ++dx) {
            const Shift shift{around.x + dx, around.y + dy};
            if (std::abs(shift.x) > limit || std::abs(shift.y) > limit) continue;
            const double r = correlation_at(reference, image, shift);
            if (r > highest) highest = r, best = shift;
        }
    return best;
}

Shift search_pyramid(const Image& reference, const Image& image, std::int32_t max_shift) {
    constexpr std::int32_t small_radius = 4, smallest_side = 32;
    if (max_shift <= small_radius || std::min(reference.width, reference.height) < 2 * smallest_side)
        return search(reference, image, {}, max_shift, max_shift);
    const Shift coarse = search_pyramid(halved(reference), halved(image), (max_shift + 1) / 2);
    return search(reference, image, {2 * coarse.x, 2 * coarse.y}, 2, max_shift);
}

/// image(x + dx, y + dy) for every pixel; NaN where a neighbour is missing. Separable.
Image shifted(const Image& image, double dx, double dy) {
    if (dx == 0 && dy == 0) return image;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const auto pass = [&](const Image& in, double shift, bool along_x) {
        const auto whole = static_cast<std::int32_t>(std::floor(shift));
        const std::array<double, 4> w = cubic_weights(shift - whole);
        Image out{in.width, in.height, std::vector<double>(in.values.size(), nan)};
        const std::int32_t limit = along_x ? in.width : in.height;
        for (std::int32_t y = 0; y < in.height; ++y)
            for (std::int32_t x = 0; x < in.width; ++x) {
                const std::int32_t first = (along_x ? x : y) + whole - 1;
                if (first < 0 || first + 3 >= limit) continue;
                double sum = 0;
                for (std::int32_t i = 0; i < 4; ++i)
                    sum += w[static_cast<std::size_t>(i)] *
                           (along_x ? in.at(first + i, y) : in.at(x, first + i));
                out.values[static_cast<std::size_t>(y) * static_cast<std::size_t>(in.width) +
                           static_cast<std::size_t>(x)] = sum;
            }
        return out;
    };
    return pass(pass(image, dx, true), dy, false);
}

/// Regression sums over both images, each moved by half of the shift towards the other.
RegressionSums sums_at(const Image& reference, const Image& image, double dx, double dy) {
    const Image a = shifted(reference, -dx / 2, -dy / 2), b = shifted(image, dx / 2, dy / 2);
    return sums_of(a, b);
}

/// Maximises the correlation within `limit` by parabolic interpolation with decreasing step.
void refine(const Image& reference, const Image& image, double limit, double& x, double& y) {
    for (const double h : {0.5, 0.25, 0.1, 0.05}) {
        const auto f = [&](double dx, double dy) {
            return sums_at(reference, image, x + dx, y + dy).correlation();
        };
        const double centre = f(0, 0);
        const auto step = [&](double minus, double plus) {
            const double curvature = minus - 2 * centre + plus;
            if (!(curvature < 0)) return minus > plus ? -h : h;
            return std::clamp(0.5 * h * (minus - plus) / curvature, -h, h);
        };
        const double sx = step(f(-h, 0), f(h, 0)), sy = step(f(0, -h), f(0, h));
        x = std::clamp(x + sx, -limit, limit), y = std::clamp(y + sy, -limit, limit);
    }
}

/// Standard errors of the shift (x, y).
void estimate_errors(const Image& reference, const Image& image, double x, double y, Agreement& out) {
    constexpr double h = 0.5;
    const auto pair_at = [&](double dx, double dy) {
        return std::pair{shifted(reference, -(x + dx) / 2, -(y + dy) / 2),
                         shifted(image, (x + dx) / 2, (y + dy) / 2)};
    };
    const auto at = [&](double dx, double dy) {
        const auto [a, b] = pair_at(dx, dy);
        return normalised_difference(a, b);
    };
    const auto [a, b] = pair_at(0, 0);
    const FittedImages fit{a, b, {at(h, 0), at(0, h)}, {at(-h, 0), at(0, -h)}, h};
    // Compute the curvature of -correlation.
    const auto correlation = [](const Image& difference) { return total(block_shares(difference)); };
    const double centre = correlation(at(0, 0));
    const double hxx = -(correlation(fit.minus[0]) - 2 * centre + correlation(fit.plus[0])) / (h * h);
    const double hyy = -(correlation(fit.minus[1]) - 2 * centre + correlation(fit.plus[1])) / (h * h);
    const double hxy =
        -(correlation(at(h, h)) + correlation(at(-h, -h)) - correlation(at(h, -h)) - correlation(at(-h, h))) /
        (4 * h * h);
    const double determinant = hxx * hyy - hxy * hxy;
    if (!(hxx > 0 && hyy > 0 && determinant > 0)) return;
    const std::vector<double> variances = fit_variances(
        fit, std::array{hyy / determinant, -hxy / determinant, -hxy / determinant, hxx / determinant});
    out.error_x_px = std::sqrt(variances[0]);
    out.error_y_px = std::sqrt(variances[1]);
}

} // namespace

RegressionSums sums_of(const Image& a, const Image& b) {
    RegressionSums sums;
    for (std::size_t i = 0; i < a.values.size(); ++i)
        if (!std::isnan(a.values[i] + b.values[i])) sums.add(a.values[i], b.values[i]);
    return sums;
}

Image normalised_difference(const Image& a, const Image& b) {
    const RegressionSums s = sums_of(a, b);
    const auto n = static_cast<double>(s.n);
    const double mean_a = s.a / n, mean_b = s.b / n;
    const double sigma_a = std::sqrt(s.aa / n - mean_a * mean_a),
                 sigma_b = std::sqrt(s.bb / n - mean_b * mean_b);
    Image out{a.width, a.height, a.values};
    for (std::size_t i = 0; i < out.values.size(); ++i)
        out.values[i] = (a.values[i] - mean_a) / sigma_a - (b.values[i] - mean_b) / sigma_b;
    return out;
}

BlockShares block_shares(const Image& difference) {
    const auto n = static_cast<double>(std::count_if(difference.values.begin(), difference.values.end(),
                                                     [](double v) { return !std::isnan(v); }));
    BlockShares out{};
    for (std::int32_t y = 0; y < difference.height; ++y)
        for (std::int32_t x = 0; x < difference.width; ++x) {
            const double v = difference.at(x, y);
            if (std::isnan(v)) continue;
            const std::int32_t block =
                y * grid_blocks / difference.height * grid_blocks + x * grid_blocks / difference.width;
            out[static_cast<std::size_t>(block)] -= v * v / (2 * n);
        }
    return out;
}

double total(const BlockShares& shares) {
    return std::accumulate(shares.begin(), shares.end(), 0.0);
}

Image smoothed(const Image& image) {
    constexpr std::int32_t radius = 3;
    std::array<double, 2 * radius + 1> kernel{};
    for (std::int32_t i = -radius; i <= radius; ++i)
        kernel[static_cast<std::size_t>(i + radius)] = std::exp(-0.5 * i * i);
    const auto pass = [&](const Image& in, bool along_x) {
        Image out{in.width, in.height, in.values};
        const std::int32_t limit = along_x ? in.width : in.height;
        for (std::int32_t y = 0; y < in.height; ++y)
            for (std::int32_t x = 0; x < in.width; ++x) {
                double sum = 0, weights = 0;
                const std::int32_t centre = along_x ? x : y;
                for (std::int32_t i = -radius; i <= radius; ++i) {
                    if (centre + i < 0 || centre + i >= limit) continue;
                    const double value = along_x ? in.at(x + i, y) : in.at(x, y + i);
                    if (std::isnan(value)) continue;
                    const double weight = kernel[static_cast<std::size_t>(i + radius)];
                    sum += weight * value, weights += weight;
                }
                double& value = out.values[static_cast<std::size_t>(y) * static_cast<std::size_t>(in.width) +
                                           static_cast<std::size_t>(x)];
                if (!std::isnan(value)) value = sum / weights;
            }
        return out;
    };
    return pass(pass(image, true), false);
}

Agreement compare_images(const Image& reference, const Image& image, const RegistrationSettings& settings) {
    if (reference.width != image.width || reference.height != image.height)
        throw InputError(fmt::format("the images have {} x {} and {} x {} pixels, allowed are equal sizes",
                                     reference.width, reference.height, image.width, image.height));
    const std::int32_t limit =
        std::min({settings.max_shift_px, reference.width / 2 - 1, reference.height / 2 - 1});
    Agreement out;
    out.limit_px = limit;
    out.correlation_unshifted = correlation_at(reference, image, {});
    if (limit > 0) {
        const Shift whole = search_pyramid(reference, image, limit);
        out.shift_x_px = whole.x, out.shift_y_px = whole.y;
    }
    if (limit > 0 && settings.sub_pixel) {
        const Image a = smoothed(reference), b = smoothed(image);
        double &x = out.shift_x_px, &y = out.shift_y_px;
        refine(a, b, limit, x, y);
        const auto correlation = [&](double dx, double dy) { return sums_at(a, b, dx, dy).correlation(); };
        out.at_limit_x = ends_at_limit(x, limit, [&](double beyond) { return correlation(beyond, y); });
        out.at_limit_y = ends_at_limit(y, limit, [&](double beyond) { return correlation(x, beyond); });
        // At a limit the other shift is the best one beside it only.
        out.error_x_px = out.error_y_px = std::numeric_limits<double>::infinity();
        if (!out.at_limit_x && !out.at_limit_y) estimate_errors(a, b, x, y, out);
    }
    const RegressionSums s = sums_at(reference, image, out.shift_x_px, out.shift_y_px);
    out.pixels = s.n;
    out.correlation = s.correlation();
    if (out.correlation < -0.999999 && s.n < 2) throw InputError("the images have no pixels in common");
    const auto n = static_cast<double>(s.n);
    if (settings.with_offset) {
        const double va = s.aa - s.a * s.a / n;
        if (!(va > 1e-14 * s.aa)) throw InputError("the reference is flat: nothing to compare");
        out.scale = (s.ab - s.a * s.b / n) / va;
        out.offset = (s.b - out.scale * s.a) / n;
    } else {
        if (!(s.aa > 0)) throw InputError("the reference is zero everywhere: nothing to compare");
        out.scale = s.ab / s.aa;
    }
    const double square = s.bb + out.scale * out.scale * s.aa + n * out.offset * out.offset -
                          2 * out.scale * s.ab - 2 * out.offset * s.b + 2 * out.scale * out.offset * s.a;
    out.residual_rms = std::sqrt(std::max(0.0, square / n));
    out.image_rms = std::sqrt(s.bb / n);
    return out;
}

Image residual_image(const Image& reference, const Image& image, const Agreement& agreement) {
    Image out = shifted(image, agreement.shift_x_px, agreement.shift_y_px);
    for (std::size_t i = 0; i < out.values.size(); ++i)
        out.values[i] -= agreement.scale * reference.values[i] + agreement.offset;
    return out;
}

BlockDisagreement compare_blocks(const Image& reference, const Image& image, const Agreement& agreement,
                                 std::int32_t size, double floor) {
    struct Block {
        double expected = 0, got = 0;
    };
    std::vector<Block> blocks;
    for (std::int32_t y0 = 0; y0 + size <= reference.height; y0 += size)
        for (std::int32_t x0 = 0; x0 + size <= reference.width; x0 += size) {
            Block block;
            for (std::int32_t y = y0; y < y0 + size; ++y)
                for (std::int32_t x = x0; x < x0 + size; ++x) {
                    block.expected += agreement.scale * reference.at(x, y) + agreement.offset;
                    block.got += image.at(x, y);
                }
            if (!std::isnan(block.expected + block.got)) blocks.push_back(block);
        }
    double brightest = 0;
    for (const Block& block : blocks)
        brightest = std::max(brightest, block.expected);
    std::vector<double> errors;
    for (const Block& block : blocks)
        if (block.expected > floor * brightest && block.expected > 0)
            errors.push_back(std::abs(block.got - block.expected) / block.expected);
    BlockDisagreement out;
    out.blocks = static_cast<std::int64_t>(errors.size());
    if (errors.empty()) return out;
    std::sort(errors.begin(), errors.end());
    out.worst = errors.back();
    out.median = errors[errors.size() / 2];
    return out;
}

} // namespace obscura::tools
