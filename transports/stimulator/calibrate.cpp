// SPDX-License-Identifier: Apache-2.0
#include "transports/stimulator/calibrate.hpp"

#include "core/error.hpp"
#include "transports/stimulator/linear_solve.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace obscura::transports {
namespace {

// Fraction of the usual contrast below which a camera pixel does not see the screen.
constexpr double seen_fraction = 0.15;
constexpr double stripe_contrast = 0.35;  // stripes of lower contrast count as not resolved
constexpr std::size_t largest_spot = 400; // camera pixels; a larger spot is dust or a shadow

using Image = std::vector<float>;

double median(std::vector<float> values) {
    if (values.empty()) return 0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

double percentile(std::vector<float> values, double share) {
    if (values.empty()) return 0;
    const auto at =
        values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

/// Least-squares polynomial in two variables of total degree 1, 3 or 5 over a box.
class Surface {
public:
    Surface(double x0, double y0, double x1, double y1)
        : x0_(x0), y0_(y0), sx_(2 / std::max(x1 - x0, 1.0)), sy_(2 / std::max(y1 - y0, 1.0)) {}
    /// Returns false if the points do not determine the polynomial.
    bool fit(const std::vector<PixelPoint>& at, const std::vector<double>& values) {
        if (at.size() >= 60 && fit_degree<21>(at, values)) return true;
        if (at.size() >= 24 && fit_degree<10>(at, values)) return true;
        return at.size() >= 6 && fit_degree<3>(at, values);
    }
    /// Value at `p`; outside of the box the value at its edge, because extrapolation diverges.
    [[nodiscard]] double operator()(PixelPoint p) const {
        const std::array<double, 21> terms = basis(p);
        double sum = 0;
        for (std::size_t i = 0; i < count_; ++i)
            sum += coefficients_[i] * terms[i];
        return sum;
    }

private:
    [[nodiscard]] std::array<double, 21> basis(PixelPoint p) const {
        const double x = std::clamp((p.x - x0_) * sx_ - 1, -1.0, 1.0);
        const double y = std::clamp((p.y - y0_) * sy_ - 1, -1.0, 1.0);
        std::array<double, 21> terms{};
        std::size_t i = 0;
        for (int degree = 0; degree <= 5; ++degree) {
            for (int j = 0; j <= degree; ++j) {
                double term = 1;
                for (int k = 0; k < degree - j; ++k)
                    term *= x;
                for (int k = 0; k < j; ++k)
                    term *= y;
                terms[i++] = term;
            }
        }
        return terms;
    }
    template<std::size_t n>
    bool fit_degree(const std::vector<PixelPoint>& at, const std::vector<double>& values) {
        NormalEquations<n> equations;
        for (std::size_t i = 0; i < at.size(); ++i) {
            const auto all = basis(at[i]);
            std::array<double, n> some{};
            std::copy_n(all.begin(), n, some.begin());
            equations.add(some, values[i]);
        }
        std::array<double, n> solution{};
        if (!equations.solve(solution)) return false;
        std::copy(solution.begin(), solution.end(), coefficients_.begin());
        count_ = n;
        return true;
    }
    double x0_, y0_, sx_, sy_;
    std::array<double, 21> coefficients_{};
    std::size_t count_ = 0;
};

class Calibration {
public:
    Calibration(const PatternSequence& sequence,
                const std::function<const Capture*(const std::string&)>& capture,
                const CalibrationSettings& settings, CalibrationReport& report)
        : sequence_(sequence), capture_(capture), settings_(settings), report_(report) {}

    CalibrationTable run() {
        find_screen();
        decode_all();
        first_homography();
        find_dots();
        fit_map();
        measure_curve();
        measure_uniformity();
        if (settings_.find_dead_pixels) find_dead_pixels();
        return std::move(table_);
    }

private:
    [[noreturn]] static void fail(const std::string& line) { throw InputError("calibration: " + line); }

    const Image& need(const std::string& name) {
        const Capture* capture = capture_(name);
        if (capture == nullptr) fail(fmt::format("capture '{}' is missing", name));
        if (width_ == 0) {
            width_ = capture->width;
            height_ = capture->height;
            if (width_ < 16 || height_ < 16)
                fail(fmt::format("capture '{}' has {}x{} pixels", name, width_, height_));
        }
        if (capture->width != width_ || capture->height != height_)
            fail(fmt::format("capture '{}' has {}x{} pixels, the others have {}x{}", name, capture->width,
                             capture->height, width_, height_));
        return capture->pixels;
    }
    [[nodiscard]] std::size_t at(std::int32_t x, std::int32_t y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
    }

    void find_screen() {
        const Image& white = need("white");
        const Image& black = need("black");
        if (settings_.camera_width > 0 &&
            (width_ != settings_.camera_width || height_ != settings_.camera_height))
            fail(fmt::format("captures have {}x{} pixels, the sensor has {}x{}", width_, height_,
                             settings_.camera_width, settings_.camera_height));
        dark_ = capture_("dark") != nullptr ? need("dark") : black;
        const std::size_t n = white.size();
        std::size_t saturated = 0;
        contrast_.resize(n);
        for (std::size_t i = 0; i < n; ++i) {
            contrast_[i] = white[i] - black[i];
            saturated += white[i] >= settings_.saturation ? 1 : 0;
        }
        if (static_cast<double>(saturated) > 0.001 * static_cast<double>(n))
            fail(fmt::format("capture 'white': {:.1f} % of the pixels are saturated, expose for less",
                             100.0 * static_cast<double>(saturated) / static_cast<double>(n)));
        usual_ = percentile(contrast_, 0.95);
        // Estimate the noise from the differences of neighbouring pixels in the dark.
        std::vector<float> steps;
        for (std::size_t i = 1; i < n; i += 3)
            steps.push_back(std::abs(black[i] - black[i - 1]));
        noise_ = std::max(median(steps), 1e-6);
        if (!(usual_ > 10 * noise_))
            fail(fmt::format(
                "capture 'white' is brighter than 'black' by {:.1f} DN only, with a noise of {:.1f} DN",
                usual_, noise_));
        seen_.assign(n, 0);
        std::size_t seen = 0;
        for (std::size_t i = 0; i < n; ++i)
            if (contrast_[i] > seen_fraction * usual_) {
                seen_[i] = 1;
                ++seen;
            }
        report_.seen_percent = 100.0 * static_cast<double>(seen) / static_cast<double>(n);
        if (report_.seen_percent < 1)
            fail(fmt::format("the camera sees the screen in {:.2f} % of its pixels only",
                             report_.seen_percent));
    }

    /// Decodes the screen coordinate of every camera pixel that sees the screen. Returns the width of the
    /// finest stripes resolved.
    int decode(const char* what, int bits, std::int32_t side, Image& position) {
        const std::size_t n = contrast_.size();
        std::vector<std::uint32_t> code(n, 0);
        int resolved = 0;
        for (int bit = 0; bit < bits; ++bit) {
            const Image& plain = need(fmt::format("{}_{:02}", what, bit));
            const Image& inverse = need(fmt::format("{}_{:02}_inverse", what, bit));
            std::vector<float> strength;
            for (std::size_t i = 0; i < n; i += 7)
                if (seen_[i] != 0) strength.push_back(std::abs(plain[i] - inverse[i]) / contrast_[i]);
            const double typical = median(strength);
            if (typical < stripe_contrast) break;
            for (std::size_t i = 0; i < n; ++i)
                code[i] = code[i] << 1 | (plain[i] > inverse[i] ? 1u : 0u);
            ++resolved;
        }
        if (resolved < std::min(3, bits))
            fail(fmt::format(
                "the stripes of '{}_{:02}' cannot be told from each other; is the order right, is it sharp?",
                what, resolved));
        const int cell = 1 << (bits - resolved);
        position.assign(n, 0);
        for (std::size_t i = 0; i < n; ++i) {
            if (seen_[i] == 0) continue;
            position[i] = static_cast<float>(from_gray(code[i])) * static_cast<float>(cell) +
                          static_cast<float>(cell - 1) * 0.5F;
            if (position[i] >= static_cast<float>(side)) seen_[i] = 0;
        }
        return cell;
    }

    void decode_all() {
        report_.finest_column_stripe = decode("column", sequence_.column_bits(), sequence_.width(), x_);
        report_.finest_row_stripe = decode("row", sequence_.row_bits(), sequence_.height(), y_);
    }

    void first_homography() {
        std::vector<PixelPoint> from, to;
        const std::size_t step = std::max<std::size_t>(1, contrast_.size() / 20000);
        for (std::size_t i = 0; i < contrast_.size(); i += step) {
            if (seen_[i] == 0) continue;
            from.push_back({x_[i], y_[i]});
            to.push_back({static_cast<double>(i % static_cast<std::size_t>(width_)),
                          static_cast<double>(i / static_cast<std::size_t>(width_))});
        }
        const auto all_from = from, all_to = to;
        for (int pass = 0; pass < 5; ++pass) {
            if (!fit_homography(from, to, rough_)) fail("the decoded stripes do not cover an area");
            std::vector<float> miss;
            for (std::size_t i = 0; i < all_from.size(); ++i) {
                const PixelPoint p = rough_(all_from[i]);
                miss.push_back(static_cast<float>(std::hypot(p.x - all_to[i].x, p.y - all_to[i].y)));
            }
            // Reject outliers: a wrongly decoded pixel is far off.
            limit_ = std::max(2.0, 4 * median(miss));
            from.clear();
            to.clear();
            for (std::size_t i = 0; i < all_from.size(); ++i)
                if (miss[i] <= limit_) {
                    from.push_back(all_from[i]);
                    to.push_back(all_to[i]);
                }
        }
        if (from.size() < all_from.size() / 2)
            fail("the decoded stripes contradict each other; were camera, screen and light at rest?");
    }

    void find_dots() {
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

    /// Centroid of the light of a dot near `centre`; returns false if there is no dot.
    [[nodiscard]] bool centroid(const Image& dots, const Image& black, double scale,
                                PixelPoint& centre) const {
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

    void fit_map() {
        Surface du(0, 0, 1, 1), dv(0, 0, 1, 1);
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
            du = dv = Surface(x0 - margin, y0 - margin, x1 + margin, y1 + margin);
            if (!du.fit(dot_screen_, u) || !dv.fit(dot_screen_, v)) fail("the dots found lie in a line");
            square = 0;
            std::vector<double> miss;
            for (std::size_t i = 0; i < u.size(); ++i) {
                miss.push_back(std::hypot(u[i] - du(dot_screen_[i]), v[i] - dv(dot_screen_[i])));
                square += miss.back() * miss.back();
            }
            report_.residual_rms_px = std::sqrt(square / static_cast<double>(u.size()));
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
            if (clean) break;
            if (kept < 12) fail("the dots found contradict each other");
        }
        report_.dots_used = static_cast<int>(dot_screen_.size());

        // Place nodes at the dots and one or two more on each side; nodes without a dot take the value of the
        // polynomial surface.
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
        // Add the residual of the dots, averaged over neighbouring dots: optics are smooth, the error of a
        // single dot is not.
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
                        const double w =
                            known[dot] / ((1.0 + std::abs(r - row)) * (1.0 + std::abs(c - column)));
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

    void measure_curve() {
        const Image& white = need("white");
        double full = 0;
        std::vector<std::size_t> bright; // where the signal is good
        for (std::size_t i = 0; i < white.size(); ++i)
            if (seen_[i] != 0 && contrast_[i] > 0.5 * usual_) {
                bright.push_back(i);
                full += static_cast<double>(white[i]) - dark_[i];
            }
        std::vector<double> weight;
        for (const Pattern& pattern : sequence_.patterns()) {
            if (pattern.name.rfind("ramp_", 0) != 0) continue;
            const Image& ramp = need(pattern.name);
            double sum = 0;
            for (const std::size_t i : bright)
                sum += static_cast<double>(ramp[i]) - dark_[i];
            const double luminance = std::max(0.0, sum / full);
            if (!table_.curve.empty() && luminance < table_.curve.back().luminance - 0.02)
                fail(fmt::format("capture '{}' is darker than the one before by {:.1f} % of white; was the "
                                 "exposure fixed?",
                                 pattern.name, 100 * (table_.curve.back().luminance - luminance)));
            table_.curve.push_back({static_cast<double>(pattern.level), luminance});
            weight.push_back(1);
        }
        // Make the curve monotone, because noise may make it fall a little (pool adjacent violators).
        std::vector<CurvePoint> pooled;
        std::vector<std::size_t> size;
        for (const CurvePoint& p : table_.curve) {
            pooled.push_back(p);
            size.push_back(1);
            while (pooled.size() > 1 && pooled[pooled.size() - 2].luminance > pooled.back().luminance) {
                const auto n = static_cast<double>(size.back()),
                           m = static_cast<double>(size[size.size() - 2]);
                const double mean =
                    (pooled.back().luminance * n + pooled[pooled.size() - 2].luminance * m) / (n + m);
                pooled.pop_back();
                size[size.size() - 2] += size.back();
                size.pop_back();
                pooled.back().luminance = mean;
            }
        }
        std::size_t next = 0;
        for (std::size_t block = 0; block < pooled.size(); ++block)
            for (std::size_t i = 0; i < size[block]; ++i)
                table_.curve[next++].luminance = pooled[block].luminance;
        report_.black_to_white = table_.curve.front().luminance / table_.curve.back().luminance;
        try {
            RadiometricCurve(table_.levels, table_.curve);
        } catch (const ConfigError& error) {
            fail(error.what());
        }
    }

    void measure_uniformity() {
        const Image& white = need("white");
        UniformityGrid& g = table_.uniformity;
        const int step = settings_.uniformity_step;
        g.step = step;
        g.columns = sequence_.width() / step + 2;
        g.rows = sequence_.height() / step + 2;
        // Fit a plane to the neighbourhood of each node, weighted by distance: unbiased at the node even if
        // all data lie on one side.
        std::vector<NormalEquations<3>> planes(static_cast<std::size_t>(g.columns * g.rows));
        std::vector<int> count(planes.size(), 0);
        const double margin = std::max(2.0, 2 / report_.camera_per_screen);
        for (std::size_t i = 0; i < white.size(); ++i) {
            const double x = x_[i], y = y_[i];
            if (seen_[i] == 0 || x < margin || y < margin || x > sequence_.width() - 1 - margin ||
                y > sequence_.height() - 1 - margin)
                continue;
            const int cx = static_cast<int>(x / step), cy = static_cast<int>(y / step);
            for (int r = cy; r <= cy + 1; ++r) {
                for (int c = cx; c <= cx + 1; ++c) {
                    const double dx = x / step - c, dy = y / step - r;
                    const auto node = static_cast<std::size_t>(r * g.columns + c);
                    planes[node].add({1, dx, dy}, static_cast<double>(white[i]) - dark_[i],
                                     (1 - std::abs(dx)) * (1 - std::abs(dy)) + 1e-9);
                    ++count[node];
                }
            }
        }
        g.values.assign(planes.size(), -1);
        float brightest = 0;
        for (std::size_t i = 0; i < planes.size(); ++i) {
            std::array<double, 3> plane{};
            if (count[i] < 12 || !planes[i].solve(plane) || !(plane[0] > 0)) continue;
            g.values[i] = static_cast<float>(plane[0]);
            brightest = std::max(brightest, g.values[i]);
        }
        if (!(brightest > 0))
            fail("the uniformity of the screen cannot be measured: too few camera pixels see it");
        // Fill nodes out of view with the mean of their neighbours, from the rim of the view outwards.
        for (bool holes = true; holes;) {
            holes = false;
            const auto before = g.values;
            for (int r = 0; r < g.rows; ++r) {
                for (int c = 0; c < g.columns; ++c) {
                    const auto node = static_cast<std::size_t>(r * g.columns + c);
                    if (before[node] >= 0) continue;
                    float sum = 0;
                    int n = 0;
                    for (int j = std::max(0, r - 1); j <= std::min(g.rows - 1, r + 1); ++j)
                        for (int i = std::max(0, c - 1); i <= std::min(g.columns - 1, c + 1); ++i)
                            if (const float value = before[static_cast<std::size_t>(j * g.columns + i)];
                                value >= 0) {
                                sum += value;
                                ++n;
                            }
                    if (n > 0)
                        g.values[node] = sum / static_cast<float>(n);
                    else
                        holes = true;
                }
            }
        }
        white_level_ = brightest;
        for (float& value : g.values) {
            value /= brightest;
            report_.uniformity_min = std::min(report_.uniformity_min, static_cast<double>(value));
        }
    }

    void find_dead_pixels() {
        report_.dead_pixels_resolved = report_.camera_per_screen >= 0.8;
        if (!report_.dead_pixels_resolved) return;
        const Image& white = need("white");
        const Image& black = need("black");
        const double margin = std::max(2.0, 2 / report_.camera_per_screen);
        Image missing(white.size(), 0), excess(white.size(), 0);
        // Without a dark capture use the typical value of the black one instead.
        const bool has_dark = capture_("dark") != nullptr;
        const auto usual_dark = static_cast<float>(has_dark ? 0 : median(black));
        const auto dark = [&](std::size_t i) { return has_dark ? dark_[i] : usual_dark; };
        std::vector<float> leaks;
        for (std::size_t i = 0; i < black.size(); i += 5)
            if (seen_[i] != 0) leaks.push_back((black[i] - dark(i)) / contrast_[i]);
        const double leak = median(leaks);
        for (std::int32_t v = 0; v < height_; ++v) {
            for (std::int32_t u = 0; u < width_; ++u) {
                const std::size_t i = at(u, v);
                const PixelPoint p = table_.map.inverse({static_cast<double>(u), static_cast<double>(v)});
                if (!(p.x > margin && p.y > margin && p.x < sequence_.width() - 1 - margin &&
                      p.y < sequence_.height() - 1 - margin))
                    continue;
                const double expected = white_level_ * table_.uniformity(p);
                if (expected < seen_fraction * usual_) continue;
                missing[i] = static_cast<float>(1 - (white[i] - dark_[i]) / expected);
                excess[i] = static_cast<float>((black[i] - dark(i)) / expected - leak);
            }
        }
        collect(missing);
        collect(excess);
        std::sort(table_.dead.begin(), table_.dead.end(), [](const ScreenPixel& a, const ScreenPixel& b) {
            return a.y != b.y ? a.y < b.y : a.x < b.x;
        });
        table_.dead.erase(std::unique(table_.dead.begin(), table_.dead.end()), table_.dead.end());
    }

    /// Finds spots whose light is too low or too high by about one screen pixel's light or more.
    void collect(const Image& off) {
        std::vector<float> size;
        for (std::size_t i = 0; i < off.size(); i += 3)
            if (off[i] != 0) size.push_back(std::abs(off[i]));
        const auto threshold = static_cast<float>(std::max(0.12, 5 * 1.4826 * median(size)));
        std::vector<std::uint8_t> done(off.size(), 0);
        std::vector<std::size_t> spot;
        for (std::size_t start = 0; start < off.size(); ++start) {
            if (done[start] != 0 || off[start] <= threshold) continue;
            spot.assign(1, start);
            done[start] = 1;
            for (std::size_t k = 0; k < spot.size() && k < largest_spot; ++k) {
                const auto x = static_cast<std::int32_t>(spot[k] % static_cast<std::size_t>(width_));
                const auto y = static_cast<std::int32_t>(spot[k] / static_cast<std::size_t>(width_));
                for (std::int32_t j = std::max(0, y - 1); j <= std::min(height_ - 1, y + 1); ++j)
                    for (std::int32_t i = std::max(0, x - 1); i <= std::min(width_ - 1, x + 1); ++i)
                        if (const std::size_t n = at(i, j); done[n] == 0 && off[n] > threshold) {
                            done[n] = 1;
                            spot.push_back(n);
                        }
            }
            if (spot.size() >= largest_spot) continue;
            mark(off, spot);
        }
    }

    void mark(const Image& off, const std::vector<std::size_t>& spot) {
        std::int32_t x0 = width_, y0 = height_, x1 = -1, y1 = -1;
        for (const std::size_t i : spot) {
            const auto x = static_cast<std::int32_t>(i % static_cast<std::size_t>(width_));
            const auto y = static_cast<std::int32_t>(i / static_cast<std::size_t>(width_));
            x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
        }
        // Include the faint rim of the spot.
        x0 = std::max(0, x0 - 1), y0 = std::max(0, y0 - 1);
        x1 = std::min(width_ - 1, x1 + 1), y1 = std::min(height_ - 1, y1 + 1);
        double sum = 0, x = 0, y = 0;
        for (std::int32_t j = y0; j <= y1; ++j)
            for (std::int32_t i = x0; i <= x1; ++i) {
                const double value = off[at(i, j)];
                sum += value;
                x += value * i;
                y += value * j;
            }
        if (!(sum > 0)) return;
        const PixelPoint centre = table_.map.inverse({x / sum, y / sum});
        // Compute the number of camera pixels that one screen pixel covers here.
        const PixelPoint c0 = table_.map(centre), cx1 = table_.map({centre.x + 1, centre.y}),
                         cy1 = table_.map({centre.x, centre.y + 1});
        const double area = std::abs((cx1.x - c0.x) * (cy1.y - c0.y) - (cx1.y - c0.y) * (cy1.x - c0.x));
        const double screen_pixels = sum / area;
        if (!(screen_pixels >= 0.5)) return; // dust on the screen or a grain of noise
        const auto on_screen = [&](std::int32_t sx, std::int32_t sy) {
            return sx >= 0 && sy >= 0 && sx < sequence_.width() && sy < sequence_.height();
        };
        if (screen_pixels < 1.6) {
            const auto sx = static_cast<std::int32_t>(std::lround(centre.x));
            const auto sy = static_cast<std::int32_t>(std::lround(centre.y));
            if (on_screen(sx, sy)) table_.dead.push_back({sx, sy});
            return;
        }
        // Mark adjacent dead pixels: as many as the light deviation amounts to, where it is largest.
        struct Candidate {
            float off;
            ScreenPixel pixel;
        };
        std::vector<Candidate> candidates;
        const auto radius =
            static_cast<std::int32_t>(std::ceil((x1 - x0 + y1 - y0) / report_.camera_per_screen));
        const auto cx = static_cast<std::int32_t>(std::lround(centre.x));
        const auto cy = static_cast<std::int32_t>(std::lround(centre.y));
        for (std::int32_t sy = cy - radius; sy <= cy + radius; ++sy) {
            for (std::int32_t sx = cx - radius; sx <= cx + radius; ++sx) {
                const PixelPoint c = table_.map({static_cast<double>(sx), static_cast<double>(sy)});
                if (!on_screen(sx, sy) || c.x < x0 || c.y < y0 || c.x >= x1 || c.y >= y1) continue;
                const auto u = static_cast<std::int32_t>(c.x), v = static_cast<std::int32_t>(c.y);
                const auto fx = static_cast<float>(c.x - u), fy = static_cast<float>(c.y - v);
                const float value = (off[at(u, v)] * (1 - fx) + off[at(u + 1, v)] * fx) * (1 - fy) +
                                    (off[at(u, v + 1)] * (1 - fx) + off[at(u + 1, v + 1)] * fx) * fy;
                candidates.push_back({value, {sx, sy}});
            }
        }
        std::sort(candidates.begin(), candidates.end(),
                  [](const Candidate& a, const Candidate& b) { return a.off > b.off; });
        const auto count = std::min(candidates.size(), static_cast<std::size_t>(std::lround(screen_pixels)));
        for (std::size_t i = 0; i < count; ++i)
            table_.dead.push_back(candidates[i].pixel);
    }

    const PatternSequence& sequence_;
    const std::function<const Capture*(const std::string&)>& capture_;
    const CalibrationSettings& settings_;
    CalibrationReport& report_;
    std::int32_t width_ = 0, height_ = 0;
    Image dark_, contrast_;
    double usual_ = 0, noise_ = 0, white_level_ = 1, limit_ = 2;
    std::vector<std::uint8_t> seen_;
    Image x_, y_; // screen position that each camera pixel sees
    Homography rough_;
    std::vector<PixelPoint> dot_screen_, dot_camera_;
    std::vector<int> dot_index_;
    CalibrationTable table_;
};

} // namespace

CalibrationTable calibrate(const PatternSequence& sequence,
                           const std::function<const Capture*(const std::string&)>& capture,
                           const CalibrationSettings& settings, CalibrationReport& report) {
    return Calibration(sequence, capture, settings, report).run();
}

} // namespace obscura::transports
