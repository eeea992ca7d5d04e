// SPDX-License-Identifier: Apache-2.0
#include "transports/stimulator/radiometric_curve.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace obscura::transports {
namespace {
constexpr int guide_cells = 4096;
}

RadiometricCurve::RadiometricCurve(int levels) : luminance_(static_cast<std::size_t>(levels)) {
    assert(levels >= 2 && levels <= 65536);
    for (int i = 0; i < levels; ++i)
        luminance_[static_cast<std::size_t>(i)] = static_cast<float>(i) / static_cast<float>(levels - 1);
    index();
}

RadiometricCurve::RadiometricCurve(int levels, std::span<const CurvePoint> points)
    : luminance_(static_cast<std::size_t>(levels)) {
    assert(levels >= 2 && levels <= 65536);
    if (points.size() < 2) throw ConfigError("radiometric curve: fewer than 2 points");
    if (points.front().level != 0 || points.back().level != levels - 1)
        throw ConfigError(fmt::format("radiometric curve: runs from level {} to {} instead of 0 to {}",
                                      points.front().level, points.back().level, levels - 1));
    const std::size_t n = points.size();
    const double top = points.back().luminance;
    for (std::size_t i = 0; i < n; ++i) {
        const CurvePoint& p = points[i];
        if (!std::isfinite(p.luminance) || p.luminance < 0)
            throw ConfigError(
                fmt::format("radiometric curve: luminance {} at level {}", p.luminance, p.level));
        if (i > 0 && !(p.level > points[i - 1].level))
            throw ConfigError(
                fmt::format("radiometric curve: level {} follows {}", p.level, points[i - 1].level));
        if (i > 0 && p.luminance < points[i - 1].luminance)
            throw ConfigError(fmt::format("radiometric curve: luminance falls from level {} to {}",
                                          points[i - 1].level, p.level));
    }
    if (!(top > points.front().luminance))
        throw ConfigError("radiometric curve: the highest level is no brighter than the lowest");

    std::vector<double> secant(n - 1), slope(n);
    for (std::size_t i = 0; i + 1 < n; ++i)
        secant[i] = (points[i + 1].luminance - points[i].luminance) / (points[i + 1].level - points[i].level);
    for (std::size_t i = 1; i + 1 < n; ++i) {
        const double h0 = points[i].level - points[i - 1].level, h1 = points[i + 1].level - points[i].level;
        const double w0 = 2 * h1 + h0, w1 = h1 + 2 * h0;
        slope[i] = secant[i - 1] > 0 && secant[i] > 0 ? (w0 + w1) / (w0 / secant[i - 1] + w1 / secant[i]) : 0;
    }
    // Use one-sided three-point slopes at the ends, limited to the monotone range.
    const auto end_slope = [](double h0, double h1, double s0, double s1) {
        const double s = ((2 * h0 + h1) * s0 - h0 * s1) / (h0 + h1);
        return s <= 0 ? 0.0 : std::min(s, 3 * s0);
    };
    if (n == 2) {
        slope[0] = slope[1] = secant[0];
    } else {
        slope[0] = end_slope(points[1].level - points[0].level, points[2].level - points[1].level, secant[0],
                             secant[1]);
        slope[n - 1] = end_slope(points[n - 1].level - points[n - 2].level,
                                 points[n - 2].level - points[n - 3].level, secant[n - 2], secant[n - 3]);
    }
    std::size_t segment = 0;
    for (int level = 0; level < levels; ++level) {
        while (segment + 2 < n && points[segment + 1].level <= level)
            ++segment;
        const CurvePoint &a = points[segment], &b = points[segment + 1];
        const double h = b.level - a.level, t = (level - a.level) / h;
        const double t2 = t * t, t3 = t2 * t;
        const double value = (2 * t3 - 3 * t2 + 1) * a.luminance + (t3 - 2 * t2 + t) * h * slope[segment] +
                             (-2 * t3 + 3 * t2) * b.luminance + (t3 - t2) * h * slope[segment + 1];
        luminance_[static_cast<std::size_t>(level)] = static_cast<float>(value / top);
    }
    for (std::size_t i = 1; i < luminance_.size(); ++i) // rounding may make the last bit fall
        luminance_[i] = std::max(luminance_[i], luminance_[i - 1]);
    index();
}

void RadiometricCurve::index() {
    guide_.resize(guide_cells + 1);
    std::size_t level = 0;
    for (int cell = 0; cell <= guide_cells; ++cell) {
        const float value = static_cast<float>(cell) / guide_cells;
        while (level + 2 < luminance_.size() && luminance_[level + 1] <= value)
            ++level;
        guide_[static_cast<std::size_t>(cell)] = static_cast<std::uint16_t>(level);
    }
}

float RadiometricCurve::drive(float luminance) const noexcept {
    const std::size_t last = luminance_.size() - 1;
    if (!(luminance > luminance_.front())) return 0; // NaN as well
    if (luminance >= luminance_.back()) return static_cast<float>(last);
    const auto cell = static_cast<std::size_t>(luminance * guide_cells);
    // The level lies between the guide's entries for this cell and the next.
    std::size_t low = guide_[cell];
    std::size_t high = std::min<std::size_t>(guide_[std::min<std::size_t>(cell + 1, guide_cells)] + 1u, last);
    while (high - low > 1) {
        const std::size_t middle = (low + high) / 2;
        if (luminance_[middle] <= luminance)
            low = middle;
        else
            high = middle;
    }
    const float rise = luminance_[low + 1] - luminance_[low];
    return static_cast<float>(low) + (rise > 0 ? (luminance - luminance_[low]) / rise : 0);
}

} // namespace obscura::transports
