// SPDX-License-Identifier: Apache-2.0
#include "renderer/camera/distortion.hpp"

#include "core/error.hpp"
#include "core/monotone_cubic.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::renderer {
namespace {

using Model = scene::Distortion::Model;

} // namespace

Distortion::Distortion(const scene::Distortion& d, double focal_length_m) : model_(d.model) {
    const std::size_t most = model_ == Model::none || model_ == Model::table ? 0
                             : model_ == Model::brown_conrady                ? 5
                             : model_ == Model::radial                       ? 4
                                                                             : 12;
    if (d.coefficients.size() > most)
        throw ConfigError(
            fmt::format("camera: distortion: {} coefficients, allowed at most {} with this model",
                        d.coefficients.size(), most));
    if (model_ != Model::table && !(d.ideal_mm.empty() && d.real_mm.empty()))
        throw ConfigError("camera: distortion: a table is given, allowed only with the model of that name");
    for (const double c : d.coefficients)
        if (!std::isfinite(c)) throw ConfigError("camera: distortion: a coefficient is not finite");
    std::copy(d.coefficients.begin(), d.coefficients.end(), k_);
    if (model_ != Model::table) return;
    if (d.ideal_mm.size() != d.real_mm.size() || d.ideal_mm.size() < 2)
        throw ConfigError(fmt::format(
            "camera: distortion table: {} ideal and {} real distances, allowed as many of each, at least 2",
            d.ideal_mm.size(), d.real_mm.size()));
    for (std::size_t i = 0; i < d.ideal_mm.size(); ++i) {
        ideal_.push_back(d.ideal_mm[i] * 1e-3 / focal_length_m);
        real_.push_back(d.real_mm[i] * 1e-3 / focal_length_m);
        const bool rises =
            i == 0 ? ideal_[0] == 0 && real_[0] == 0 : ideal_[i] > ideal_[i - 1] && real_[i] > real_[i - 1];
        if (!rises)
            throw ConfigError(fmt::format(
                "camera: distortion table: entry {}: allowed are distances that begin at 0 and increase",
                i + 1));
    }
    slopes_ = monotone_slopes(ideal_, real_);
}

PlanePoint Distortion::formula(PlanePoint p) const {
    const double x = p.x;
    const double y = p.y;
    const double r2 = x * x + y * y;
    switch (model_) {
    case Model::brown_conrady: {
        const double radial = 1 + r2 * (k_[0] + r2 * (k_[1] + r2 * k_[2]));
        return {x * radial + k_[3] * (r2 + 2 * x * x) + 2 * k_[4] * x * y,
                y * radial + k_[4] * (r2 + 2 * y * y) + 2 * k_[3] * x * y};
    }
    case Model::opencv: {
        const double radial =
            (1 + r2 * (k_[0] + r2 * (k_[1] + r2 * k_[4]))) / (1 + r2 * (k_[5] + r2 * (k_[6] + r2 * k_[7])));
        return {x * radial + 2 * k_[2] * x * y + k_[3] * (r2 + 2 * x * x) + r2 * (k_[8] + r2 * k_[9]),
                y * radial + k_[2] * (r2 + 2 * y * y) + 2 * k_[3] * x * y + r2 * (k_[10] + r2 * k_[11])};
    }
    case Model::radial: {
        const double radial = 1 + r2 * (k_[0] + r2 * (k_[1] + r2 * (k_[2] + r2 * k_[3])));
        return {x * radial, y * radial};
    }
    case Model::none:
    case Model::table:
        break;
    }
    return p;
}

Distortion::Derivatives Distortion::derivatives(PlanePoint p) const {
    constexpr double h = 1e-5;
    const PlanePoint right = formula({p.x + h, p.y});
    const PlanePoint left = formula({p.x - h, p.y});
    const PlanePoint below = formula({p.x, p.y + h});
    const PlanePoint above = formula({p.x, p.y - h});
    return {(right.x - left.x) / (2 * h), (below.x - above.x) / (2 * h), (right.y - left.y) / (2 * h),
            (below.y - above.y) / (2 * h)};
}

// Newton's method, starting at the target. It does not cross a fold of the polynomial, where the determinant
// changes sign.
std::optional<PlanePoint> Distortion::inverse(PlanePoint target, double& determinant) const {
    PlanePoint p = target;
    for (int step = 0; step < 60; ++step) {
        const PlanePoint at = formula(p);
        const double ex = target.x - at.x;
        const double ey = target.y - at.y;
        const Derivatives d = derivatives(p);
        determinant = d.determinant();
        const double scale = 1 + std::abs(target.x) + std::abs(target.y);
        if (std::abs(ex) + std::abs(ey) < 1e-14 * scale)
            return determinant > 0 ? std::optional(p) : std::nullopt;
        if (!(determinant > 1e-3)) {
            // Beyond a fold: step back towards the axis.
            p = {p.x * 0.8, p.y * 0.8};
            continue;
        }
        p.x += (d.yy * ex - d.xy * ey) / determinant;
        p.y += (d.xx * ey - d.yx * ex) / determinant;
        if (!std::isfinite(p.x + p.y)) return std::nullopt;
    }
    return std::nullopt;
}

std::optional<PlanePoint> Distortion::look_up(PlanePoint p, const std::vector<double>& from,
                                              const std::vector<double>& slopes,
                                              const std::vector<double>& to) {
    const double r = std::sqrt(p.x * p.x + p.y * p.y);
    if (r > from.back()) return std::nullopt;
    if (r == 0) return p;
    const double image = monotone_cubic(from, to, slopes, r);
    return PlanePoint{p.x * image / r, p.y * image / r};
}

std::optional<PlanePoint> Distortion::real(PlanePoint ideal) const {
    if (model_ == Model::none) return ideal;
    if (model_ == Model::table) return look_up(ideal, ideal_, slopes_, real_);
    double unused = 0;
    return model_ == Model::brown_conrady ? inverse(ideal, unused) : std::optional(formula(ideal));
}

std::optional<PlanePoint> Distortion::ideal(PlanePoint real, double& area_ratio) const {
    area_ratio = 1;
    if (model_ == Model::none) return real;
    if (model_ == Model::brown_conrady) {
        area_ratio = derivatives(real).determinant();
        return area_ratio > 0 ? std::optional(formula(real)) : std::nullopt;
    }
    if (model_ != Model::table) {
        double determinant = 1;
        const std::optional<PlanePoint> p = inverse(real, determinant);
        area_ratio = 1 / determinant;
        return p;
    }
    const double r = std::sqrt(real.x * real.x + real.y * real.y);
    if (r > real_.back()) return std::nullopt;
    const auto image = [&](double at) { return look_up({at, 0}, ideal_, slopes_, real_)->x; };
    // Solve the monotone cubic by bisection.
    double low = 0;
    double high = ideal_.back();
    for (int i = 0; i < 60 && r > 0; ++i) {
        const double middle = (low + high) / 2;
        (image(middle) < r ? low : high) = middle;
    }
    const double at = r > 0 ? (low + high) / 2 : 0;
    const double h = 1e-5 * ideal_.back();
    const double from = std::max(0.0, at - h);
    const double to = std::min(ideal_.back(), at + h);
    const double slope = (image(to) - image(from)) / (to - from);
    const double scale = r > 0 ? at / r : 1 / slope;
    area_ratio = scale / slope;
    return PlanePoint{real.x * scale, real.y * scale};
}

} // namespace obscura::renderer
