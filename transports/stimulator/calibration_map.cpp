// SPDX-License-Identifier: Apache-2.0
// Geometry of a calibration: from the dots to the map of screen and camera.
#include "transports/stimulator/calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace obscura::transports {

void Calibration::find_dots() {
    const int columns = sequence_.dot_columns(), rows = sequence_.dot_rows();
    struct Local {
        NormalEquations<3> u, v;
        int count = 0;
    };
    std::vector<Local> local(static_cast<std::size_t>(columns * rows));
    const auto step = static_cast<double>(sequence_.dot_step());
    for (std::size_t i = 0; i < contrast_.size(); ++i) {
        if (seen_[i] == 0) continue;
        const int column = static_cast<int>(x_[i] / step), row = static_cast<int>(y_[i] / step);
        if (column >= columns || row >= rows) continue;
        const double u = static_cast<double>(i % static_cast<std::size_t>(width_));
        const double v = static_cast<double>(i / static_cast<std::size_t>(width_));
        const PixelPoint guess = rough_({x_[i], y_[i]});
        if (std::hypot(guess.x - u, guess.y - v) > 3 * limit_) continue;
        const PixelPoint centre = sequence_.dot(column, row);
        Local& l = local[static_cast<std::size_t>(row * columns + column)];
        const std::array<double, 3> terms{1, (x_[i] - centre.x) / step, (y_[i] - centre.y) / step};
        l.u.add(terms, u);
        l.v.add(terms, v);
        ++l.count;
    }
    const Image& dots = need("dots");
    const Image& black = need("black");
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            const Local& l = local[static_cast<std::size_t>(row * columns + column)];
            std::array<double, 3> u{}, v{};
            if (l.count < 8 || !l.u.solve(u) || !l.v.solve(v)) continue; // not in view
            const double scale = std::sqrt(std::abs(u[1] * v[2] - u[2] * v[1])) / step;
            PixelPoint centre{u[0], v[0]};
            if (centroid(dots, black, scale, centre)) {
                dot_screen_.push_back(sequence_.dot(column, row));
                dot_camera_.push_back(centre);
                dot_index_.push_back(row * columns + column);
            } else {
                ++report_.dots_rejected;
            }
        }
    }
    if (dot_screen_.size() < 12)
        fail(fmt::format("capture 'dots': {} of {} dots were found, at least 12 are needed",
                         dot_screen_.size(), columns * rows));
}

bool Calibration::centroid(const Image& dots, const Image& black, double scale, PixelPoint& centre) const {
    const double radius = sequence_.dot_radius() * scale;
    const double reach = std::min(radius + 2.5, 0.48 * sequence_.dot_step() * scale);
    double sum = 0;
    for (int pass = 0; pass < 4; ++pass) {
        double x = 0, y = 0;
        sum = 0;
        const auto x0 = static_cast<std::int32_t>(std::floor(centre.x - reach));
        const auto x1 = static_cast<std::int32_t>(std::ceil(centre.x + reach));
        const auto y0 = static_cast<std::int32_t>(std::floor(centre.y - reach));
        const auto y1 = static_cast<std::int32_t>(std::ceil(centre.y + reach));
        if (x0 < 0 || y0 < 0 || x1 >= width_ || y1 >= height_) return false;
        for (std::int32_t py = y0; py <= y1; ++py) {
            for (std::int32_t px = x0; px <= x1; ++px) {
                const std::size_t i = at(px, py);
                if (seen_[i] == 0) return false; // at the rim of the screen
                const double dx = px - centre.x, dy = py - centre.y;
                // Use a soft edge, so that the pixel raster of the window does not bias the centroid.
                const double inside = std::clamp(reach - std::hypot(dx, dy) + 0.5, 0.0, 1.0);
                const double weight =
                    inside * std::max(0.0, static_cast<double>(dots[i] - black[i]) / contrast_[i] - 0.05);
                sum += weight;
                x += weight * px;
                y += weight * py;
            }
        }
        if (!(sum > 0)) return false;
        centre = {x / sum, y / sum};
    }
    const double expected = 3.14159265358979 * radius * radius;
    return sum > 0.5 * expected && sum < 1.6 * expected;
}

/// Leaves out the dots that miss the surfaces by far. Returns whether there were any.
bool Calibration::reject_dots(const std::vector<double>& miss) {
    const double worst = std::max(0.3, 5 * report_.residual_rms_px);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < miss.size(); ++i) {
        if (miss[i] > worst) continue;
        dot_screen_[kept] = dot_screen_[i];
        dot_camera_[kept] = dot_camera_[i];
        dot_index_[kept++] = dot_index_[i];
    }
    const bool clean = kept == miss.size();
    report_.dots_rejected += static_cast<int>(miss.size() - kept);
    dot_screen_.resize(kept);
    dot_camera_.resize(kept);
    dot_index_.resize(kept);
    return !clean;
}

/// Fits the homography and the surfaces of what it leaves, without dots that contradict the others.
void Calibration::fit_surfaces(PolynomialSurface& du, PolynomialSurface& dv) {
    std::vector<double> u, v;
    for (int pass = 0; pass < 3; ++pass) {
        if (!fit_homography(dot_screen_, dot_camera_, table_.map.homography))
            fail("the dots found do not cover an area");
        double x0 = 1e9, y0 = 1e9, x1 = -1e9, y1 = -1e9, square = 0;
        u.clear();
        v.clear();
        for (std::size_t i = 0; i < dot_screen_.size(); ++i) {
            const PixelPoint p = table_.map.homography(dot_screen_[i]);
            u.push_back(dot_camera_[i].x - p.x);
            v.push_back(dot_camera_[i].y - p.y);
            square += u.back() * u.back() + v.back() * v.back();
            x0 = std::min(x0, dot_screen_[i].x);
            y0 = std::min(y0, dot_screen_[i].y);
            x1 = std::max(x1, dot_screen_[i].x);
            y1 = std::max(y1, dot_screen_[i].y);
        }
        report_.homography_rms_px = std::sqrt(square / static_cast<double>(u.size()));
        const auto margin = static_cast<double>(sequence_.dot_step());
        du = dv = PolynomialSurface(x0 - margin, y0 - margin, x1 + margin, y1 + margin);
        if (!du.fit(dot_screen_, u) || !dv.fit(dot_screen_, v)) fail("the dots found lie in a line");
        square = 0;
        std::vector<double> miss;
        for (std::size_t i = 0; i < u.size(); ++i) {
            miss.push_back(std::hypot(u[i] - du(dot_screen_[i]), v[i] - dv(dot_screen_[i])));
            square += miss.back() * miss.back();
        }
        report_.residual_rms_px = std::sqrt(square / static_cast<double>(u.size()));
        if (!reject_dots(miss)) break;
        if (dot_screen_.size() < 12) fail("the dots found contradict each other");
    }
}

/// Places nodes at the dots and one or two more on each side; nodes without a dot take the value of the
/// polynomial surface.
void Calibration::place_nodes(const PolynomialSurface& du, const PolynomialSurface& dv) {
    DistortionGrid& g = table_.map.distortion;
    g.columns = sequence_.dot_columns() + 3;
    g.rows = sequence_.dot_rows() + 3;
    g.step = sequence_.dot_step();
    g.x0 = sequence_.dot(0, 0).x - g.step;
    g.y0 = sequence_.dot(0, 0).y - g.step;
    for (int row = 0; row < g.rows; ++row) {
        for (int column = 0; column < g.columns; ++column) {
            const PixelPoint p{g.x0 + column * g.step, g.y0 + row * g.step};
            g.du.push_back(static_cast<float>(du(p)));
            g.dv.push_back(static_cast<float>(dv(p)));
        }
    }
}

/// Adds the residual of the dots, averaged over neighbouring dots: optics are smooth, the error of a single
/// dot is not.
void Calibration::add_residuals(const PolynomialSurface& du, const PolynomialSurface& dv) {
    DistortionGrid& g = table_.map.distortion;
    const int columns = sequence_.dot_columns(), rows = sequence_.dot_rows();
    std::vector<PixelPoint> left(static_cast<std::size_t>(columns * rows));
    std::vector<std::uint8_t> known(left.size(), 0);
    for (std::size_t i = 0; i < dot_index_.size(); ++i) {
        const PixelPoint p = table_.map.homography(dot_screen_[i]);
        const auto dot = static_cast<std::size_t>(dot_index_[i]);
        left[dot] = {dot_camera_[i].x - p.x - du(dot_screen_[i]),
                     dot_camera_[i].y - p.y - dv(dot_screen_[i])};
        known[dot] = 1;
    }
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            PixelPoint sum;
            double weight = 0;
            for (int r = std::max(0, row - 1); r <= std::min(rows - 1, row + 1); ++r) {
                for (int c = std::max(0, column - 1); c <= std::min(columns - 1, column + 1); ++c) {
                    const auto dot = static_cast<std::size_t>(r * columns + c);
                    const double w = known[dot] / ((1.0 + std::abs(r - row)) * (1.0 + std::abs(c - column)));
                    sum.x += w * left[dot].x;
                    sum.y += w * left[dot].y;
                    weight += w;
                }
            }
            if (weight < 1) continue; // the dot itself, or most of its neighbours
            const auto node = static_cast<std::size_t>((row + 1) * g.columns + column + 1);
            g.du[node] += static_cast<float>(sum.x / weight);
            g.dv[node] += static_cast<float>(sum.y / weight);
        }
    }
}

void Calibration::fit_map() {
    PolynomialSurface du(0, 0, 1, 1), dv(0, 0, 1, 1);
    fit_surfaces(du, dv);
    report_.dots_used = static_cast<int>(dot_screen_.size());
    place_nodes(du, dv);
    add_residuals(du, dv);
    table_.screen_width = sequence_.width();
    table_.screen_height = sequence_.height();
    table_.camera_width = width_;
    table_.camera_height = height_;
    table_.levels = sequence_.levels();
    table_.residual_px = report_.residual_rms_px;
    const PixelPoint middle = dot_screen_[dot_screen_.size() / 2];
    const PixelPoint a = table_.map({middle.x + 1, middle.y}), b = table_.map({middle.x - 1, middle.y});
    report_.camera_per_screen = std::hypot(a.x - b.x, a.y - b.y) / 2;
}

} // namespace obscura::transports
