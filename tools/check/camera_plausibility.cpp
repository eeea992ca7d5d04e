// SPDX-License-Identifier: Apache-2.0
#include "tools/check/camera_plausibility.hpp"

#include "core/realtime/realtime.hpp"
#include "emulator/unit/thread_plan.hpp"
#include "tools/check/frame_estimate.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace obscura::tools {
namespace {

double milliseconds(std::int64_t ns) {
    return static_cast<double>(ns) * 1e-6;
}

/// Period of the triggers, or of free run; none: software and lockstep triggers come when they are sent.
std::optional<double> period_ms(const emulator::DaemonConfig& config, const CameraSettings& settings) {
    if (!settings.frame_trigger.enabled)
        return settings.frame_rate_enabled ? std::optional(1000 / settings.frame_rate_hz) : std::nullopt;
    if (line_of(config.camera.settings.frame_trigger.source) >= line_count) return std::nullopt;
    const sync::SourceKind* kind = config.trigger.lines[emulator::initial_trigger_line(config)].kind();
    if (kind == nullptr || kind->traits().group == sync::SourceGroup::simulator) return std::nullopt;
    const sync::RationalRate rate = emulator::nominal_trigger_rate(config);
    return 1000 / (rate.hz() * 1.0 / settings.trigger_divider);
}

/// Conversion of charge to digital numbers, without noise.
struct Conversion {
    SignalFigures figures;
    double dn_per_e = 1;

    Conversion(const emulator::DaemonConfig& config, const CameraSettings& settings) {
        const DetectorSettings& detector = config.sensor.detector;
        figures.full_well_e = detector.full_well_e;
        figures.black_dn = detector.offset_dn + settings.black_level_dn;
        figures.max_dn = std::exp2(detector.adc_bits) - 1;
        figures.exposure_us = static_cast<double>(settings.exposure_ns) * 1e-3;
        dn_per_e = detector.gain_dn_per_e * std::pow(10, settings.gain_db / 20);
    }
    void set_obtained(const FrameWindow& window) {
        figures.obtained_us = static_cast<double>(window.exposure_max_ns) * 1e-3;
    }
    [[nodiscard]] double dn(double electrons) const { return figures.black_dn + dn_per_e * electrons; }
    [[nodiscard]] bool saturates(double electrons) const {
        return electrons >= figures.full_well_e || dn(electrons) >= figures.max_dn;
    }
    void finish(double brightest_e, std::uint64_t saturated, std::uint64_t pixels) {
        figures.brightest_e = brightest_e;
        figures.brightest_dn = dn(brightest_e);
        if (pixels > 0)
            figures.saturated_share = static_cast<double>(saturated) / static_cast<double>(pixels);
    }
};

/// Whether frames show the light of the scene under the configured settings.
bool shows_signal(const emulator::DaemonConfig& config, const CameraSettings& settings) {
    return settings.exposure_auto == ExposureAuto::off && settings.test_pattern == ImagePattern::off &&
           config.sensor.detector.test_pattern == TestPattern::off;
}

/// Figures of a renderer with so many threads.
RenderFigures figures_of(const FrameCost& cost, std::size_t threads) {
    const std::size_t running =
        std::clamp<std::size_t>(threads, 1, std::max<std::size_t>(1, permitted_cores().count()));
    return {cost.cpu_s * 1000 / static_cast<double>(running), cost.seconds * 1000, cost.at_least};
}

} // namespace

Plausibility view_of_camera(const std::string& name, const emulator::DaemonConfig& config,
                            const emulator::Imaging& imaging) {
    const emulator::FrameOrder order = imaging.nominal_order(1);
    const double first_s = to_seconds(order.shown.at(order.scene_time).ns);
    return Plausibility(name, *imaging.renderer, instants_of(imaging.renderer->scene(), first_s),
                        !config.simulator.enabled);
}

TimeFigures times_of_camera(const emulator::DaemonConfig& config, const emulator::Imaging& imaging) {
    const CameraSettings& settings = imaging.camera.initial;
    const ReadoutAnswer answer = imaging.maker->answer(settings);
    TimeFigures times;
    times.period_ms = period_ms(config, settings);
    times.shortest_period_ms = milliseconds(answer.frame_period_ns);
    times.readout_ms = milliseconds(answer.readout_ns);
    times.exposure_ms = milliseconds(settings.exposure_ns);
    return times;
}

std::optional<SignalFigures> signal_of_frame(const emulator::DaemonConfig& config, const Frame& frame) {
    CameraSettings settings = emulator::initial_camera(config).settings;
    if (!shows_signal(config, settings)) return std::nullopt;
    settings.gain_db = frame.info.gain_db;
    settings.exposure_ns = frame.info.exposure_ns;
    Conversion conversion(config, settings);
    double brightest_e = 0;
    std::uint64_t saturated = 0;
    const auto pixels =
        static_cast<std::size_t>(frame.info.width) * static_cast<std::size_t>(frame.info.height);
    if (const PixelTruth* truth = frame.pixel_truth())
        for (std::size_t i = 0; i < pixels; ++i) {
            const double e = static_cast<double>(truth->mean_e[i]);
            brightest_e = std::max(brightest_e, e);
            saturated += truth->saturated[i] != 0 || conversion.saturates(e) ? 1 : 0;
        }
    conversion.finish(brightest_e, saturated, pixels);
    conversion.set_obtained(frame.info.windows[0]);
    return conversion.figures;
}

void add_estimates(Plausibility& plausibility, const emulator::DaemonConfig& config,
                   const emulator::Imaging& imaging, double limit_s, const RowsDone& rows_done) {
    const FrameRef frame = imaging.pool->acquire();
    const emulator::FrameOrder order = imaging.nominal_order(1);
    if (!imaging.maker->prepare(order, *frame).empty()) return;
    const sensors::ReadoutPlan& plan = imaging.maker->plan();
    const std::span<const double> response = imaging.detector->electrons_per_s_per_w_m2();
    Conversion conversion(config, order.settings);
    double brightest_e = 0;
    std::uint64_t saturated = 0, pixels = 0;
    const auto expose = [&](std::span<const float> light, std::span<const RowTime> rows) {
        const std::size_t plane = light.size() / response.size(), columns = plane / rows.size();
        for (std::size_t i = 0; i < plane; ++i) {
            double per_s = config.sensor.detector.dark_current_e_per_s;
            for (std::size_t b = 0; b < response.size(); ++b)
                per_s += response[b] * static_cast<double>(light[b * plane + i]);
            const double e = per_s * to_seconds(rows[i / columns].exposure_ns());
            brightest_e = std::max(brightest_e, e);
            saturated += conversion.saturates(e) ? 1 : 0;
        }
        pixels += plane;
    };
    const FrameCost cost = estimate_frame(*imaging.renderer,
                                          {.windows = plan.windows,
                                           .rows = plan.rows,
                                           .push_broom = config.sensor.readout.shutter == Shutter::push_broom,
                                           .block_rows = config.render.band_rows},
                                          limit_s, expose, rows_done);
    conversion.finish(brightest_e, saturated, pixels);
    conversion.figures.rows_share = cost.share;
    conversion.set_obtained(plan.windows.front());
    if (pixels > 0 && shows_signal(config, order.settings)) plausibility.add_signal(conversion.figures);
    const CoreSet cores = emulator::configured_threads(config).render.cores;
    const std::size_t threads = config.render.threads > 0 ? static_cast<std::size_t>(config.render.threads)
                                : cores.any()             ? cores.count()
                                                          : permitted_cores().count();
    plausibility.add_rendering(figures_of(cost, threads));
}

void add_estimates(Plausibility& plausibility, const renderer::Renderer& renderer, double limit_s,
                   const RowsDone& rows_done) {
    const scene::Camera& camera = renderer.scene().camera;
    FrameWindow window;
    window.sensor = {0, 0, camera.width, camera.height};
    const std::vector<RowTime> rows(static_cast<std::size_t>(camera.height));
    float brightest = 0;
    const FrameCost cost = estimate_frame(
        renderer, {.windows = {&window, 1}, .rows = rows}, limit_s,
        [&](std::span<const float> light, std::span<const RowTime>) {
            for (const float value : light)
                brightest = std::max(brightest, value);
        },
        rows_done);
    const bool radiance = renderer.scene().quantity == scene::Quantity::radiance;
    if (cost.share > 0)
        plausibility.add_light(static_cast<double>(brightest), radiance ? "W m-2 sr-1" : "W/m2", cost.share);
    plausibility.add_rendering(figures_of(cost, permitted_cores().count()));
}

} // namespace obscura::tools
