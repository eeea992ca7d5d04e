// SPDX-License-Identifier: Apache-2.0
#include "transports/stimulator/screen_map.hpp"

#include "transports/stimulator/linear_solve.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::transports {
namespace {

Homography multiply(const Homography& a, const Homography& b) {
    Homography c;
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j)
            c.h[3 * i + j] = a.h[3 * i] * b.h[j] + a.h[3 * i + 1] * b.h[3 + j] + a.h[3 * i + 2] * b.h[6 + j];
    return c;
}

/// Similarity that moves the points' centroid to 0 and scales their mean distance from it to sqrt 2.
Homography normaliser(const std::vector<PixelPoint>& points) {
    double x = 0, y = 0, distance = 0;
    for (const PixelPoint& p : points) {
        x += p.x;
        y += p.y;
    }
    const auto n = static_cast<double>(points.size());
    x /= n;
    y /= n;
    for (const PixelPoint& p : points)
        distance += std::hypot(p.x - x, p.y - y);
    const double s = distance > 0 ? std::sqrt(2.0) * n / distance : 1;
    return {{s, 0, -s * x, 0, s, -s * y, 0, 0, 1}};
}

/// Weights of Catmull-Rom at fraction t between the second and third of four nodes.
std::array<double, 4> cubic_weights(double t) {
    const double t2 = t * t, t3 = t2 * t;
    return {-0.5 * t3 + t2 - 0.5 * t, 1.5 * t3 - 2.5 * t2 + 1, -1.5 * t3 + 2 * t2 + 0.5 * t,
            0.5 * t3 - 0.5 * t2};
}

} // namespace

PixelPoint Homography::operator()(PixelPoint p) const {
    const double w = h[6] * p.x + h[7] * p.y + h[8];
    return {(h[0] * p.x + h[1] * p.y + h[2]) / w, (h[3] * p.x + h[4] * p.y + h[5]) / w};
}

PixelPoint DistortionGrid::operator()(PixelPoint p) const {
    if (empty()) return {};
    const double gx = std::clamp((p.x - x0) / step, 0.0, static_cast<double>(columns - 1));
    const double gy = std::clamp((p.y - y0) / step, 0.0, static_cast<double>(rows - 1));
    const int ix = std::min(static_cast<int>(gx), std::max(0, columns - 2));
    const int iy = std::min(static_cast<int>(gy), std::max(0, rows - 2));
    const auto wx = cubic_weights(gx - ix), wy = cubic_weights(gy - iy);
    // Extrapolate linearly beyond the outermost nodes, so that slopes are kept at the edge.
    const auto node = [&](const std::vector<float>& values, int c, int r) {
        const auto at = [&](int cc, int rr) {
            return static_cast<double>(
                values[static_cast<std::size_t>(rr) * static_cast<std::size_t>(columns) +
                       static_cast<std::size_t>(cc)]);
        };
        const auto along_row = [&](int rr) {
            if (c < 0) return columns > 1 ? 2 * at(0, rr) - at(1, rr) : at(0, rr);
            if (c >= columns)
                return columns > 1 ? 2 * at(columns - 1, rr) - at(columns - 2, rr) : at(columns - 1, rr);
            return at(c, rr);
        };
        if (r < 0) return rows > 1 ? 2 * along_row(0) - along_row(1) : along_row(0);
        if (r >= rows) return rows > 1 ? 2 * along_row(rows - 1) - along_row(rows - 2) : along_row(rows - 1);
        return along_row(r);
    };
    PixelPoint sum;
    for (int j = 0; j < 4; ++j) {
        for (int i = 0; i < 4; ++i) {
            const double w = wx[static_cast<std::size_t>(i)] * wy[static_cast<std::size_t>(j)];
            sum.x += w * node(du, ix + i - 1, iy + j - 1);
            sum.y += w * node(dv, ix + i - 1, iy + j - 1);
        }
    }
    return sum;
}

PixelPoint ScreenMap::operator()(PixelPoint p) const {
    const PixelPoint a = homography(p), d = distortion(p);
    return {a.x + d.x, a.y + d.y};
}

PixelPoint ScreenMap::inverse(PixelPoint c) const {
    PixelPoint p = transports::inverse(homography)(c);
    if (distortion.empty()) return p;
    for (int step = 0; step < 20; ++step) {
        const PixelPoint at = (*this)(p);
        constexpr double e = 0.5;
        const PixelPoint px = (*this)({p.x + e, p.y}), py = (*this)({p.x, p.y + e});
        const double a = (px.x - at.x) / e, b = (py.x - at.x) / e;
        const double d = (px.y - at.y) / e, f = (py.y - at.y) / e;
        const double determinant = a * f - b * d;
        if (determinant == 0) break;
        const double ex = c.x - at.x, ey = c.y - at.y;
        const double dx = (f * ex - b * ey) / determinant, dy = (a * ey - d * ex) / determinant;
        p.x += dx;
        p.y += dy;
        if (std::abs(dx) + std::abs(dy) < 1e-9) break;
    }
    return p;
}

bool fit_homography(const std::vector<PixelPoint>& from, const std::vector<PixelPoint>& to,
                    Homography& result) {
    if (from.size() != to.size() || from.size() < 4) return false;
    const Homography nf = normaliser(from), nt = normaliser(to);
    // With normalised points the last element is never near 0, so it may be set to 1. The algebraic error is
    // weighted by 1/w of the previous solution, which makes it the geometric one.
    std::array<double, 8> x{};
    for (int pass = 0; pass < 3; ++pass) {
        NormalEquations<8> equations;
        for (std::size_t i = 0; i < from.size(); ++i) {
            const PixelPoint p = nf(from[i]), q = nt(to[i]);
            const double w = x[6] * p.x + x[7] * p.y + 1;
            const double weight = 1 / std::max(w * w, 1e-6);
            equations.add({p.x, p.y, 1, 0, 0, 0, -q.x * p.x, -q.x * p.y}, q.x, weight);
            equations.add({0, 0, 0, p.x, p.y, 1, -q.y * p.x, -q.y * p.y}, q.y, weight);
        }
        if (!equations.solve(x)) return false;
    }
    const Homography middle{{x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], 1}};
    result = multiply(multiply(inverse(nt), middle), nf);
    if (!(std::abs(result.h[8]) > 0)) return false;
    const double scale = result.h[8];
    for (double& v : result.h)
        v /= scale;
    return std::all_of(result.h.begin(), result.h.end(), [](double v) { return std::isfinite(v); });
}

Homography inverse(const Homography& homography) {
    const auto& m = homography.h;
    const double a = m[4] * m[8] - m[5] * m[7], b = m[5] * m[6] - m[3] * m[8], c = m[3] * m[7] - m[4] * m[6];
    const double determinant = m[0] * a + m[1] * b + m[2] * c;
    Homography r;
    r.h = {a, m[2] * m[7] - m[1] * m[8], m[1] * m[5] - m[2] * m[4],
           b, m[0] * m[8] - m[2] * m[6], m[2] * m[3] - m[0] * m[5],
           c, m[1] * m[6] - m[0] * m[7], m[0] * m[4] - m[1] * m[3]};
    for (double& v : r.h)
        v /= determinant;
    return r;
}

} // namespace obscura::transports
