// SPDX-License-Identifier: Apache-2.0
#include "tools/compare/pointing.hpp"

#include "core/error.hpp"
#include "tools/compare/registration.hpp"
#include "tools/compare/registration_error.hpp"
#include "tools/compare/registration_math.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

namespace obscura::tools {
namespace {

using images::Image;
using Parameters = std::array<double, 3>;
constexpr std::size_t parameter_count = 3;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr Parameters undetermined{infinite, infinite, infinite};

/// Directions of an image's pixels, and both images smoothed.
class Fit {
public:
    Fit(const Image& reference, const Image& image, const renderer::Projection& lens)
        : reference_(smoothed(reference)), image_(smoothed(image)), lens_(lens) {
        directions_.reserve(reference.values.size());
        for (std::int32_t y = 0; y < image.height; ++y)
            for (std::int32_t x = 0; x < image.width; x += packet_size_) {
                renderer::Doubles xs, ys, weight;
                renderer::Vec3s direction;
                for (int i = 0; i < packet_size_; ++i)
                    xs.v[i] = std::min(x + i, image.width - 1), ys.v[i] = y;
                lens.rays(xs, ys, direction, weight);
                for (int i = 0; i < packet_size_ && x + i < image.width; ++i)
                    directions_.push_back(weight.v[i] > 0 ? direction.lane(i) : Vec3{nan, nan, nan});
            }
        // One unit of each parameter moves the image by about a pixel: at the centre, and at the middle of
        // the longer half for the roll.
        const double cx = (image.width - 1) / 2.0, cy = (image.height - 1) / 2.0;
        const Vec3 centre = at(cx, cy), right = at(cx + 1, cy), down = at(cx, cy + 1);
        const double pixel_x = length(right - centre), pixel_y = length(down - centre);
        const double arm = std::max(image.width * pixel_x, image.height * pixel_y) / 4;
        unit_ = {pixel_x, pixel_y, std::min(pixel_x, pixel_y) / std::max(arm, pixel_x)};
    }

    [[nodiscard]] Pointing pointing(const Parameters& p) const {
        return {p[0] * unit_[0], p[1] * unit_[1], p[2] * unit_[2]};
    }
    [[nodiscard]] double roll_unit() const { return unit_[2]; }

    /// `image` turned; `share`: part of the turn.
    [[nodiscard]] Image turned(const Image& image, const Pointing& pointing, double share) const {
        const Pointing part{share * pointing.right_rad, share * pointing.down_rad, share * pointing.roll_rad};
        const Mat3 turn = to_matrix(part.turn());
        Image out{image.width, image.height, std::vector<double>(image.values.size(), nan)};
        for (std::size_t i = 0; i < directions_.size(); ++i) {
            const auto point = lens_.project(turn * directions_[i]);
            if (point) out.values[i] = sample(image, point->x, point->y);
        }
        return out;
    }

    [[nodiscard]] double correlation(const Parameters& p) const {
        const Image a = turned(reference_, pointing(p), -0.5), b = turned(image_, pointing(p), 0.5);
        return sums_of(a, b).correlation();
    }

    /// Normalised difference of the images, each turned by half of the angles.
    [[nodiscard]] Image difference(const Parameters& p) const {
        return normalised_difference(turned(reference_, pointing(p), -0.5), turned(image_, pointing(p), 0.5));
    }
    [[nodiscard]] const Image& reference() const { return reference_; }
    [[nodiscard]] const Image& image() const { return image_; }

private:
    static constexpr int packet_size_ = renderer::packet_size;

    [[nodiscard]] Vec3 at(double x, double y) const {
        renderer::Doubles xs, ys, weight;
        renderer::Vec3s direction;
        for (int i = 0; i < packet_size_; ++i)
            xs.v[i] = x, ys.v[i] = y;
        lens_.rays(xs, ys, direction, weight);
        return direction.lane(0);
    }

    /// Cubic convolution; NaN where a neighbour is missing.
    static double sample(const Image& image, double x, double y) {
        const double left = std::floor(x), top = std::floor(y);
        if (!(left >= 1 && top >= 1 && left + 2 < image.width && top + 2 < image.height)) {
            // The edges of the image are kept where the point is on them.
            const double column = std::round(x), row = std::round(y);
            const bool on_pixel = std::abs(x - column) < 1e-6 && std::abs(y - row) < 1e-6 && column >= 0 &&
                                  row >= 0 && column < image.width && row < image.height;
            return on_pixel ? image.at(static_cast<std::int32_t>(column), static_cast<std::int32_t>(row))
                            : nan;
        }
        const std::array<double, 4> wx = cubic_weights(x - left), wy = cubic_weights(y - top);
        const auto x0 = static_cast<std::int32_t>(left) - 1, y0 = static_cast<std::int32_t>(top) - 1;
        double sum = 0;
        for (std::int32_t j = 0; j < 4; ++j) {
            double row = 0;
            for (std::int32_t i = 0; i < 4; ++i)
                row += wx[static_cast<std::size_t>(i)] * image.at(x0 + i, y0 + j);
            sum += wy[static_cast<std::size_t>(j)] * row;
        }
        return sum;
    }

    Image reference_, image_;
    const renderer::Projection& lens_;
    std::vector<Vec3> directions_;
    Parameters unit_{};
};

using Matrix = std::array<std::array<double, 3>, 3>;

Parameters moved(Parameters p, std::size_t i, double by) {
    p[i] += by;
    return p;
}

/// Inverse of a symmetric, positive definite matrix; empty if it is not positive definite.
std::optional<Matrix> inverse(const Matrix& m) {
    const auto minor = [&](std::size_t i, std::size_t j) {
        const std::size_t a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
        return m[a][c] * m[b][d] - m[a][d] * m[b][c];
    };
    const double determinant = m[0][0] * minor(0, 0) + m[0][1] * minor(0, 1) + m[0][2] * minor(0, 2);
    if (!(m[0][0] > 0 && minor(2, 2) > 0 && determinant > 0)) return std::nullopt;
    Matrix out;
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j)
            out[i][j] = minor(j, i) / determinant;
    return out;
}

/// Curvature of minus the correlation at `p`, by differences of `h`. `f`: correlation.
template<class Correlation>
Matrix curvature(const Correlation& f, const Parameters& p, double h, Parameters& slope) {
    const double centre = f(p);
    Parameters plus{}, minus{};
    Matrix out{};
    for (std::size_t i = 0; i < parameter_count; ++i) {
        plus[i] = f(moved(p, i, h)), minus[i] = f(moved(p, i, -h));
        slope[i] = (plus[i] - minus[i]) / (2 * h);
        out[i][i] = -(plus[i] - 2 * centre + minus[i]) / (h * h);
    }
    for (std::size_t i = 0; i < parameter_count; ++i)
        for (std::size_t j = i + 1; j < parameter_count; ++j) {
            const double both = f(moved(moved(p, i, h), j, h)) + f(moved(moved(p, i, -h), j, -h));
            out[i][j] = out[j][i] =
                -(both - plus[i] - minus[i] - plus[j] - minus[j] + 2 * centre) / (2 * h * h);
        }
    return out;
}

/// Newton's method with decreasing steps, within `limits`.
void refine_pointing(const Fit& fit, const Parameters& limits, Parameters& p) {
    const auto f = [&](const Parameters& at) { return fit.correlation(at); };
    for (const double h : {0.5, 0.5, 0.25, 0.25, 0.1, 0.1, 0.1}) {
        Parameters slope{};
        const Matrix m = curvature(f, p, h, slope);
        const std::optional<Matrix> to_step = inverse(m);
        const double centre = f(p);
        Parameters step{};
        for (std::size_t i = 0; i < parameter_count; ++i) {
            // Away from the maximum: uphill.
            double s = slope[i] > 0 ? h : -h;
            if (to_step) {
                s = 0;
                for (std::size_t j = 0; j < parameter_count; ++j)
                    s += (*to_step)[i][j] * slope[j];
            }
            step[i] = std::clamp(s, -4 * h, 4 * h);
        }
        for (double share = 1; share > 0.1; share /= 2) {
            Parameters next = p;
            for (std::size_t i = 0; i < parameter_count; ++i)
                next[i] = std::clamp(p[i] + share * step[i], -limits[i], limits[i]);
            if (f(next) > centre) {
                p = next;
                break;
            }
        }
    }
}

/// Standard errors in the units of the parameters.
Parameters errors(const Fit& fit, const Parameters& limits, const Parameters& p) {
    constexpr double h = 0.5;
    Parameters out = undetermined;
    Parameters slope{};
    const auto correlation = [&](const Parameters& at) { return total(block_shares(fit.difference(at))); };
    const std::optional<Matrix> bread = inverse(curvature(correlation, p, h, slope));
    if (!bread) return out;
    // Curvature along a parameter, the others following: rounding alone gives less.
    constexpr double min_curvature = 1e-6;
    std::vector<double> inverse_curvature;
    for (std::size_t i = 0; i < parameter_count; ++i) {
        if (!(1 / (*bread)[i][i] > min_curvature)) return out;
        inverse_curvature.insert(inverse_curvature.end(), (*bread)[i].begin(), (*bread)[i].end());
    }
    const Image a = fit.turned(fit.reference(), fit.pointing(p), -0.5),
                b = fit.turned(fit.image(), fit.pointing(p), 0.5);
    FittedImages images{a, b, {}, {}, h};
    for (std::size_t i = 0; i < parameter_count; ++i) {
        images.plus.push_back(fit.difference(moved(p, i, h)));
        images.minus.push_back(fit.difference(moved(p, i, -h)));
    }
    const std::vector<double> variances = fit_variances(images, inverse_curvature);
    for (std::size_t i = 0; i < parameter_count; ++i)
        if (limits[i] > 0) out[i] = std::sqrt(variances[i]);
    return out;
}

} // namespace

Quat Pointing::turn() const {
    const Vec3 axis{-down_rad, right_rad, roll_rad};
    const double angle = length(axis);
    return angle > 0 ? axis_angle(axis / angle, angle) : Quat{};
}

Image turned(const Image& image, const renderer::Projection& lens, const Pointing& pointing) {
    return Fit(image, image, lens).turned(image, pointing, 1);
}

PointingFit fit_pointing(const Image& reference, const Image& image, const renderer::Projection& lens,
                         const PointingSettings& settings) {
    // compare_images() checks the sizes and finds the shift without roll.
    RegistrationSettings shift;
    shift.max_shift_px = settings.max_shift_px;
    shift.sub_pixel = false;
    const Agreement plain = compare_images(reference, image, shift);
    const Fit fit(reference, image, lens);
    const auto limit = static_cast<double>(plain.limit_px);
    const Parameters limits{limit, limit, settings.max_roll_rad / fit.roll_unit()};

    // Search the rolls in steps of two pixels at the middle of the longer half.
    Parameters best{plain.shift_x_px, plain.shift_y_px, 0};
    double highest = fit.correlation(best);
    constexpr double step = 2;
    for (double roll = step; roll <= limits[2] + 1e-9; roll += step)
        for (const double p : {roll, -roll}) {
            const Image rolled = fit.turned(image, fit.pointing({0, 0, p}), 1);
            const Agreement a = compare_images(reference, rolled, shift);
            const Parameters there{a.shift_x_px, a.shift_y_px, p};
            const double r = fit.correlation(there);
            if (r > highest) highest = r, best = there;
        }
    refine_pointing(fit, limits, best);
    PointingFit out;
    out.pointing = fit.pointing(best);
    out.limit_px = plain.limit_px;
    bool* const at_limit[] = {&out.right_at_limit, &out.down_at_limit, &out.roll_at_limit};
    for (std::size_t i = 0; i < parameter_count; ++i)
        *at_limit[i] = ends_at_limit(best[i], limits[i], [&](double beyond) {
            return fit.correlation(moved(best, i, beyond - best[i]));
        });
    out.error = fit.pointing(out.at_limit() ? undetermined : errors(fit, limits, best));
    out.correlation = fit.correlation(best);
    return out;
}

Image i_over_f(const Image& values, const renderer::Projection& lens, bool radiance, double sun_w_m2) {
    Image out{values.width, values.height, values.values};
    for (std::int32_t y = 0; y < values.height; ++y)
        for (std::int32_t x = 0; x < values.width; ++x) {
            const double solid_angle = radiance ? 1 : lens.solid_angle_sr(x, y);
            double& v = out.values[static_cast<std::size_t>(y) * static_cast<std::size_t>(values.width) +
                                   static_cast<std::size_t>(x)];
            v = solid_angle > 0 ? v * std::numbers::pi / (solid_angle * sun_w_m2) : nan;
        }
    return out;
}

} // namespace obscura::tools
