// SPDX-License-Identifier: Apache-2.0
#include "transports/stimulator/optical.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace obscura::transports {

namespace {

constexpr auto bayer_table = [] {
    std::array<std::uint8_t, 256> table{};
    for (unsigned y = 0; y < 16; ++y)
        for (unsigned x = 0; x < 16; ++x)
            table[16 * y + x] = static_cast<std::uint8_t>(bayer16(x, y));
    return table;
}();

constexpr int max_samples = 16;

RadiometricCurve make_curve(const OpticalSettings& settings, const CalibrationTable* table) {
    if (table == nullptr || table->curve.empty()) return RadiometricCurve(settings.levels);
    return {settings.levels, table->curve};
}

/// Throws ConfigError if table and settings contradict each other.
void check_table(const OpticalSettings& settings, const CalibrationTable* table) {
    const std::int32_t w = settings.screen_width, h = settings.screen_height;
    if (!(settings.dn_white > settings.dn_black))
        throw ConfigError(fmt::format("stimulator: white at {} DN is not above black at {} DN",
                                      settings.dn_white, settings.dn_black));
    if (table == nullptr) return;
    if (table->screen_width != w || table->screen_height != h)
        throw ConfigError(
            fmt::format("stimulator: calibrated for a screen of {}x{} pixels, this one has {}x{}",
                        table->screen_width, table->screen_height, w, h));
    if (table->camera_width != settings.sensor_width || table->camera_height != settings.sensor_height)
        throw ConfigError(fmt::format(
            "stimulator: calibrated with a camera of {}x{} pixels, the sensor has {}x{}", table->camera_width,
            table->camera_height, settings.sensor_width, settings.sensor_height));
    if (table->levels != settings.levels)
        throw ConfigError(fmt::format("stimulator: calibrated with {} drive levels, the format has {}",
                                      table->levels, settings.levels));
}

} // namespace

OpticalStage::OpticalStage(const OpticalSettings& settings, const CalibrationTable* table)
    : settings_(settings), curve_(make_curve(settings, table)) {
    check_table(settings, table);
    const std::int32_t w = settings.screen_width, h = settings.screen_height;
    const auto pixels = static_cast<std::size_t>(w) * static_cast<std::size_t>(h);
    light_.assign(pixels, 0.0F);
    shown_.assign(static_cast<std::size_t>(w), 0.0F);
    last_row_.assign(static_cast<std::size_t>(h), -1);
    const double per_dn = 1 / (settings.dn_white - settings.dn_black);
    peak_ = settings.peak > 0 ? settings.peak : 1;

    if (table == nullptr) {
        for (std::int32_t y = 0; y < h; ++y)
            last_row_[static_cast<std::size_t>(y)] = std::min(y, settings.sensor_height - 1);
        gain0_ = static_cast<float>(peak_ * per_dn);
        return;
    }

    const double weakest = map_screen(*table);
    // Choose the sub-samples of a footprint. Linear interpolation sampled every third of a pixel preserves
    // the light of a single bright pixel to 5 %, that of a star with a point spread to 1 %. One sample is
    // enough if screen and camera pixels differ by up to 2 %.
    samples_ = widest_ <= 1.02 ? 1 : std::min(static_cast<int>(std::ceil(3 * widest_)), max_samples);

    const bool uneven = settings.use_uniformity && table->uniformity.columns > 0;
    if (!(settings.peak > 0)) peak_ = uneven ? weakest : 1;
    if (!(peak_ > 0))
        throw ConfigError("stimulator: the camera sees no light from part of the screen; set a peak");
    gain0_ = static_cast<float>(peak_ * per_dn);
    if (uneven) {
        gain_.resize(pixels);
        for (std::int32_t y = 0; y < h; ++y) {
            for (std::int32_t x = 0; x < w; ++x) {
                const double response = table->uniformity({static_cast<double>(x), static_cast<double>(y)});
                gain_[at(x, y)] = response > 0 ? static_cast<float>(peak_ * per_dn / response) : 0.0F;
            }
        }
    }
    if (settings.hide_dead_pixels && !table->dead.empty()) {
        dead_.assign(pixels, 0);
        for (const ScreenPixel& p : table->dead)
            dead_[at(p.x, p.y)] = 1;
    }
}

/// Maps every pixel of the screen to the camera. Returns the smallest uniformity that the camera sees.
double OpticalStage::map_screen(const CalibrationTable& table) {
    const std::int32_t w = settings_.screen_width, h = settings_.screen_height;
    const auto pixels = static_cast<std::size_t>(w) * static_cast<std::size_t>(h);
    direct_ = false;
    u_.resize(pixels);
    v_.resize(pixels);
    const double right = settings_.sensor_width - 0.5, bottom = settings_.sensor_height - 0.5;
    double weakest = 1e30;
    double& widest = widest_;
    std::int32_t last = -1;
    for (std::int32_t y = 0; y < h; ++y) {
        double lowest = -1;
        for (std::int32_t x = 0; x < w; ++x) {
            const PixelPoint p{static_cast<double>(x), static_cast<double>(y)};
            const PixelPoint c = table.map(p);
            u_[at(x, y)] = static_cast<float>(c.x);
            v_[at(x, y)] = static_cast<float>(c.y);
            const bool seen = c.x > -0.5 && c.x < right && c.y > -0.5 && c.y < bottom;
            if (!seen) continue;
            lowest = std::max(lowest, c.y);
            weakest = std::min(weakest, table.uniformity(p));
            const auto distance = [&](std::size_t i, std::size_t j) {
                return std::hypot(static_cast<double>(u_[i] - u_[j]), static_cast<double>(v_[i] - v_[j]));
            };
            if (x > 0) widest = std::max(widest, distance(at(x, y), at(x - 1, y)));
            if (y > 0) widest = std::max(widest, distance(at(x, y), at(x, y - 1)));
        }
        if (lowest >= 0)
            last = std::max(last, std::min(static_cast<std::int32_t>(std::ceil(lowest + widest)) + 1,
                                           settings_.sensor_height - 1));
        last_row_[static_cast<std::size_t>(y)] = last;
    }
    if (last < 0) throw ConfigError("stimulator: by its calibration the camera does not see the screen");
    return weakest;
}

Region OpticalStage::screen_region(const Region& window) const {
    const std::int32_t w = settings_.screen_width, h = settings_.screen_height;
    std::int32_t x0 = w, y0 = h, x1 = -1, y1 = -1;
    if (direct_) {
        x0 = std::max(0, window.x);
        y0 = std::max(0, window.y);
        x1 = std::min(w, window.x + window.width) - 1;
        y1 = std::min(h, window.y + window.height) - 1;
    } else {
        // A pixel depends on its footprint and, through interpolation, on one camera pixel beyond.
        const auto reach = static_cast<float>(widest_) * 0.75F + 1.0F;
        const float left = static_cast<float>(window.x) - reach;
        const float right = static_cast<float>(window.x + window.width - 1) + reach;
        const float top = static_cast<float>(window.y) - reach;
        const float bottom = static_cast<float>(window.y + window.height - 1) + reach;
        for (std::int32_t y = 0; y < h; ++y) {
            for (std::int32_t x = 0; x < w; ++x) {
                const float u = u_[at(x, y)], v = v_[at(x, y)];
                if (u < left || u > right || v < top || v > bottom) continue;
                x0 = std::min(x0, x);
                x1 = std::max(x1, x);
                y0 = std::min(y0, y);
                y1 = std::max(y1, y);
            }
        }
        if (!dead_.empty() && x1 >= x0) { // shares of a dead pixel at the edge
            x0 = std::max(0, x0 - 1);
            y0 = std::max(0, y0 - 1);
            x1 = std::min(w - 1, x1 + 1);
            y1 = std::min(h - 1, y1 + 1);
        }
    }
    if (x1 < x0 || y1 < y0) return {};
    return {x0, y0, x1 - x0 + 1, y1 - y0 + 1};
}

float OpticalStage::sample(std::span<const std::uint16_t> image, float u, float v) const noexcept {
    const std::int32_t sw = settings_.sensor_width, sh = settings_.sensor_height;
    // Half a pixel around the image belongs to its outermost pixels; beyond it the sample is black.
    if (!(u > -0.5F && v > -0.5F && u < static_cast<float>(sw) - 0.5F && v < static_cast<float>(sh) - 0.5F))
        return 0;
    const float uf = std::clamp(u, 0.0F, static_cast<float>(sw - 1));
    const float vf = std::clamp(v, 0.0F, static_cast<float>(sh - 1));
    const auto x = static_cast<std::int32_t>(uf), y = static_cast<std::int32_t>(vf);
    const float fx = uf - static_cast<float>(x), fy = vf - static_cast<float>(y);
    const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(sw);
    const std::size_t below = y + 1 < sh ? row + static_cast<std::size_t>(sw) : row;
    const auto x0 = static_cast<std::size_t>(x), x1 = x + 1 < sw ? x0 + 1 : x0;
    const float black = static_cast<float>(settings_.dn_black);
    const float upper =
        static_cast<float>(image[row + x0]) * (1 - fx) + static_cast<float>(image[row + x1]) * fx;
    const float lower =
        static_cast<float>(image[below + x0]) * (1 - fx) + static_cast<float>(image[below + x1]) * fx;
    return std::max(0.0F, upper * (1 - fy) + lower * fy - black);
}

void OpticalStage::light_row(std::span<const std::uint16_t> image, const Region& rect,
                             std::int32_t y) noexcept {
    const std::int32_t w = settings_.screen_width, h = settings_.screen_height;
    if (direct_) {
        const auto black = static_cast<float>(settings_.dn_black);
        for (std::int32_t x = rect.x; x < rect.x + rect.width; ++x) {
            float value = 0;
            if (x < settings_.sensor_width && y < settings_.sensor_height)
                value =
                    static_cast<float>(
                        image[static_cast<std::size_t>(y) * static_cast<std::size_t>(settings_.sensor_width) +
                              static_cast<std::size_t>(x)]) -
                    black;
            light_[at(x, y)] = std::max(0.0F, value) * gain0_;
        }
        return;
    }
    for (std::int32_t x = rect.x; x < rect.x + rect.width; ++x) {
        const std::size_t i = at(x, y);
        float value = 0;
        if (samples_ == 1) {
            value = sample(image, u_[i], v_[i]);
        } else {
            // Compute the footprint from differences of the map; one-sided at the rim.
            const std::size_t l = x > 0 ? i - 1 : i, r = x + 1 < w ? i + 1 : i;
            const std::size_t a = y > 0 ? i - static_cast<std::size_t>(w) : i;
            const std::size_t b = y + 1 < h ? i + static_cast<std::size_t>(w) : i;
            const float nx = r - l == 2 ? 0.5F : 1.0F,
                        ny = b - a == 2 * static_cast<std::size_t>(w) ? 0.5F : 1.0F;
            const float ux = (u_[r] - u_[l]) * nx, vx = (v_[r] - v_[l]) * nx;
            const float uy = (u_[b] - u_[a]) * ny, vy = (v_[b] - v_[a]) * ny;
            const auto n = static_cast<float>(samples_);
            for (int j = 0; j < samples_; ++j) {
                for (int k = 0; k < samples_; ++k) {
                    const float fx = (static_cast<float>(k) + 0.5F) / n - 0.5F;
                    const float fy = (static_cast<float>(j) + 0.5F) / n - 0.5F;
                    value += sample(image, u_[i] + fx * ux + fy * uy, v_[i] + fx * vx + fy * vy);
                }
            }
            value /= n * n;
        }
        light_[i] = value * (gain_.empty() ? gain0_ : gain_[i]);
    }
}

void OpticalStage::spread_row(const Region& rect, std::int32_t y) noexcept {
    const std::int32_t w = settings_.screen_width, h = settings_.screen_height;
    const auto first = static_cast<std::size_t>(rect.x), end = static_cast<std::size_t>(rect.x + rect.width);
    std::copy(light_.begin() + static_cast<std::ptrdiff_t>(at(rect.x, y)),
              light_.begin() + static_cast<std::ptrdiff_t>(at(rect.x, y)) + rect.width,
              shown_.begin() + rect.x);
    if (dead_.empty()) return;
    const auto is_dead = [&](std::int32_t x, std::int32_t yy) { return dead_[at(x, yy)] != 0; };
    const auto share = [&](std::int32_t x,
                           std::int32_t yy) { // of a dead pixel's light for each live neighbour
        int live = 0;
        live += x > 0 && !is_dead(x - 1, yy) ? 1 : 0;
        live += x + 1 < w && !is_dead(x + 1, yy) ? 1 : 0;
        live += yy > 0 && !is_dead(x, yy - 1) ? 1 : 0;
        live += yy + 1 < h && !is_dead(x, yy + 1) ? 1 : 0;
        return live > 0 ? light_[at(x, yy)] / static_cast<float>(live) : 0.0F;
    };
    for (std::size_t xs = first; xs < end; ++xs) {
        const auto x = static_cast<std::int32_t>(xs);
        if (is_dead(x, y)) continue;
        if (x > 0 && is_dead(x - 1, y)) shown_[xs] += share(x - 1, y);
        if (x + 1 < w && is_dead(x + 1, y)) shown_[xs] += share(x + 1, y);
        if (y > 0 && is_dead(x, y - 1)) shown_[xs] += share(x, y - 1);
        if (y + 1 < h && is_dead(x, y + 1)) shown_[xs] += share(x, y + 1);
    }
}

void OpticalStage::drive_row(const Region& rect, std::int32_t y, std::uint64_t frame,
                             std::span<std::uint16_t> levels) noexcept {
    const auto top = static_cast<float>(curve_.levels() - 1);
    const auto row = static_cast<unsigned>(y) & 15u;
    const unsigned turn = reversed8(frame);
    for (std::int32_t x = rect.x; x < rect.x + rect.width; ++x) {
        const float light = shown_[static_cast<std::size_t>(x)];
        if (light > 1.0001F) ++clipped_;
        float threshold = 0.5F;
        const unsigned order = bayer_table[16 * row + (static_cast<unsigned>(x) & 15u)];
        if (settings_.dither == Dither::both)
            threshold = (static_cast<float>((order + turn) & 255u) + 0.5F) / 256.0F;
        else if (settings_.dither == Dither::spatial)
            threshold = (static_cast<float>(order) + 0.5F) / 256.0F;
        else if (settings_.dither == Dither::temporal)
            threshold = (static_cast<float>(turn) + 0.5F) / 256.0F;
        const float level = std::min(curve_.drive(light) + threshold, top);
        levels[at(x, y)] = static_cast<std::uint16_t>(level);
    }
}

void OpticalStage::render(std::span<const std::uint16_t> image, const Region& rect, std::int32_t from,
                          std::int32_t to, std::uint64_t frame, std::span<std::uint16_t> levels) noexcept {
    assert(rect.inside({0, 0, settings_.screen_width, settings_.screen_height}));
    assert(levels.size() >= light_.size());
    for (std::int32_t y = from; y < to; ++y)
        light_row(image, rect, y);
    // Drive a row only when the light of the row below it is known, as that may hold dead pixels.
    const std::int32_t lag = dead_.empty() ? 0 : 1;
    const std::int32_t first = from == rect.y ? from : from - lag;
    const std::int32_t last = to == rect.y + rect.height ? to : to - lag;
    for (std::int32_t y = first; y < last; ++y) {
        spread_row(rect, y);
        drive_row(rect, y, frame, levels);
    }
}

} // namespace obscura::transports
