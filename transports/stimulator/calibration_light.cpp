// SPDX-License-Identifier: Apache-2.0
// Light of a calibration: curve and uniformity of the screen, and its dead pixels.
#include "core/error.hpp"
#include "transports/stimulator/calibration.hpp"
#include "transports/stimulator/radiometric_curve.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace obscura::transports {
namespace {

/// In camera pixels; a larger spot is dust or a shadow.
constexpr std::size_t largest_spot = 400;

} // namespace

void Calibration::measure_curve() {
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
            fail(fmt::format(
                "capture '{}' is darker than the one before by {:.1f} % of white; was the exposure fixed?",
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
            const auto n = static_cast<double>(size.back()), m = static_cast<double>(size[size.size() - 2]);
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

void Calibration::measure_uniformity() {
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

void Calibration::find_dead_pixels() {
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
    std::sort(table_.dead.begin(), table_.dead.end(),
              [](const ScreenPixel& a, const ScreenPixel& b) { return a.y != b.y ? a.y < b.y : a.x < b.x; });
    table_.dead.erase(std::unique(table_.dead.begin(), table_.dead.end()), table_.dead.end());
}

void Calibration::collect(const Image& off) {
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

void Calibration::mark(const Image& off, const std::vector<std::size_t>& spot) {
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
    const auto radius = static_cast<std::int32_t>(std::ceil((x1 - x0 + y1 - y0) / report_.camera_per_screen));
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

} // namespace obscura::transports
