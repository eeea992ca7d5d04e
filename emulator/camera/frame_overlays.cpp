// SPDX-License-Identifier: Apache-2.0
#include "emulator/camera/frame_overlays.hpp"

#include "sensors/fixed_pattern.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>

namespace obscura::emulator {
namespace {

/// Dark current of a hot pixel over the mean.
constexpr double hot_ratio = 10;
/// Stands for the dark current of a stuck pixel.
constexpr float stuck_heat = 1e30F;
/// Largest number of hot pixels of a sensor, for windows at any place.
constexpr std::size_t max_sensor_hot_pixels = 16'384;

std::span<const FrameWindow> windows_of(const FrameInfo& frame) {
    return std::span(frame.windows).first(std::min<std::size_t>(frame.window_count, max_windows));
}

} // namespace

std::vector<PixelPlace> hot_pixels(const sensors::FixedPattern& pattern, const DetectorSettings& settings,
                                   std::size_t most) {
    struct Hot {
        float heat = 0;
        PixelPlace at;
    };
    std::vector<Hot> list;
    const double codes = std::exp2(settings.adc_bits);
    const auto least = static_cast<float>(hot_ratio * settings.dark_current_e_per_s);
    for (std::int32_t y = 0; y < pattern.height; ++y) {
        const std::span stuck = pattern.stuck.row(y);
        // Hotter than any dark current.
        for (const sensors::StuckPixel& pixel : stuck)
            if (pixel.dn >= codes / 2)
                list.push_back({stuck_heat * static_cast<float>(pixel.dn), {pixel.x, y}});
        const auto is_stuck = [&stuck](std::int32_t x) {
            return std::any_of(stuck.begin(), stuck.end(), [x](const auto& pixel) { return pixel.x == x; });
        };
        const float* const dark = pattern.row_of(pattern.dark_e_per_s, y, 0);
        for (std::int32_t x = 0; dark != nullptr && x < pattern.width; ++x)
            if (dark[x] >= least && dark[x] > 0 && !is_stuck(x)) list.push_back({dark[x], {x, y}});
    }
    const auto hotter = [](const Hot& a, const Hot& b) {
        if (a.heat != b.heat) return a.heat > b.heat;
        return a.at.y != b.at.y ? a.at.y < b.at.y : a.at.x < b.at.x;
    };
    const auto end = list.begin() + static_cast<std::ptrdiff_t>(std::min(most, list.size()));
    std::partial_sort(list.begin(), end, list.end(), hotter);
    std::vector<PixelPlace> places;
    std::transform(list.begin(), end, std::back_inserter(places), [](const Hot& hot) { return hot.at; });
    return places;
}

std::shared_ptr<const FrameOverlay> FrameOverlays::of(const transports::KeptFrame& frame,
                                                      const FrameScene& scene) {
    const std::lock_guard lock(mutex_);
    if (overlay_ == nullptr || serial_ != frame.serial) {
        overlay_ = std::make_shared<const FrameOverlay>(make(frame, scene));
        serial_ = frame.serial;
    }
    return overlay_;
}

FrameOverlay FrameOverlays::make(const transports::KeptFrame& frame, const FrameScene& scene) {
    std::vector<RowTime> rows(frame.row_times.size());
    std::transform(frame.row_times.begin(), frame.row_times.end(), rows.begin(),
                   [&scene](const RowTime& row) {
                       return RowTime{scene.at(row.reset), scene.at(row.read)};
                   });
    const FrameInfo& info = frame.info;
    std::vector<double> electrons = electrons_;
    if (aperture_m_ > 0)
        for (double& e : electrons)
            e *= std::pow(scene.renderer->scene().camera.aperture_m / aperture_m_, 2);
    FrameOverlay overlay;
    overlay.seen = scene.renderer->overlay({.windows = windows_of(info),
                                            .rows = rows,
                                            .push_broom = sensor_.readout.shutter == Shutter::push_broom,
                                            .frame_id = info.frame_id,
                                            .truth = info.truth,
                                            .mid = scene.at(info.truth.mid_exposure),
                                            .electrons_per_s_per_w_m2 = electrons});
    set_names(overlay.seen.stars);
    overlay.hot_pixels = hot_pixels_in(info);
    return overlay;
}

void FrameOverlays::set_names(std::vector<renderer::OverlayStar>& stars) {
    if (!names_) names_.emplace();
    for (renderer::OverlayStar& star : stars)
        if (star.name.empty())
            star.name = names_->at(star.right_ascension_rad, star.declination_rad).shortest();
}

std::vector<PixelPlace> FrameOverlays::hot_pixels_in(const FrameInfo& frame) {
    std::vector<PixelPlace> in_image;
    // Each row of a push-broom image is the same one of the sensor: its hot pixels are columns.
    if (sensor_.readout.shutter == Shutter::push_broom) return in_image;
    if (!hot_) hot_ = hot_pixels(detector_.fixed_pattern(), sensor_.detector, max_sensor_hot_pixels);
    for (const PixelPlace& pixel : *hot_)
        for (const FrameWindow& window : windows_of(frame)) {
            const std::int32_t x = pixel.x - window.sensor.x, y = pixel.y - window.sensor.y;
            if (x >= 0 && y >= 0 && x < window.sensor.width && y < window.sensor.height &&
                in_image.size() < max_hot_pixels)
                in_image.push_back({x, y + window.image_y});
        }
    return in_image;
}

} // namespace obscura::emulator
