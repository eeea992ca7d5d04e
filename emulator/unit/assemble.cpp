// SPDX-License-Identifier: Apache-2.0
#include "emulator/unit/assemble.hpp"

#include "core/error.hpp"
#include "core/io/memory_budget.hpp"
#include "core/io/random_bytes.hpp"
#include "core/realtime/log.hpp"
#include "emulator/camera/releaser.hpp"
#include "emulator/render/render_rest.hpp"
#include "emulator/unit/render_speed.hpp"
#include "renderer/lights/detector_response.hpp"
#include "sync/settings.hpp"
#include "sync/sources/gpio.hpp"
#include "sync/sources/ptp.hpp"
#include "sync/sources/ptp_timer.hpp"
#include "sync/sources/udp.hpp"
#include "transports/file/settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

namespace obscura::emulator {

namespace {

/// Run word of the first acquisition: the configured one, or a random one.
std::uint32_t run_word(const emulator::DaemonConfig& config) {
    if (config.daemon.run >= 0) return static_cast<std::uint32_t>(config.daemon.run);
    std::uint32_t word = 0;
    fill_with_random_bytes(std::as_writable_bytes(std::span(&word, 1)));
    return word;
}

} // namespace

SceneClockSettings scene_clock_settings(const emulator::DaemonConfig& config) {
    const DaemonSection& daemon = config.daemon;
    return {.mode = daemon.scene_time,
            .start_ns = std::llround(daemon.scene_start_s * 1e9),
            .rate = daemon.scene_rate,
            .times = daemon.scene_time == SceneTime::replay ? read_scene_times(daemon.scene_times)
                                                            : std::vector<Time>{},
            .epoch = config.scene.epoch.value_or(ephemeris::Epoch{})};
}

sync::RationalRate nominal_trigger_rate(const emulator::DaemonConfig& config) {
    return sync::nominal_rate(config.trigger.lines[initial_trigger_line(config)]);
}

RenderFacts render_facts(const emulator::DaemonConfig& config, const ThreadPlan& threads) {
    const auto cores = static_cast<std::uint32_t>(threads.render.cores.any() ? threads.render.cores.count()
                                                                             : permitted_cores().count());
    return {.samples_per_pixel = static_cast<std::uint32_t>(config.render.samples_per_pixel),
            .target_error = config.render.target_error,
            .max_instants = static_cast<std::uint32_t>(config.render.max_instants),
            .threads = config.render.threads > 0 ? static_cast<std::uint32_t>(config.render.threads) : cores,
            .cores = cores};
}

renderer::RenderSettings render_settings(const emulator::DaemonConfig& config, std::size_t threads) {
    renderer::RenderSettings settings;
    settings.samples_per_pixel = static_cast<std::uint32_t>(config.render.samples_per_pixel);
    settings.threads = static_cast<std::uint32_t>(threads);
    settings.seed = config.daemon.seed;
    settings.target_error = config.render.target_error;
    settings.max_samples_per_pixel = static_cast<std::uint32_t>(config.render.max_samples_per_pixel);
    settings.max_instants = static_cast<std::uint32_t>(config.render.max_instants);
    return settings;
}

std::unique_ptr<renderer::Renderer> make_renderer(const emulator::DaemonConfig& config, scene::Scene scene,
                                                  const ThreadPlan& threads, bool wait_for_tiles) {
    const PinnedHere pinned(threads.render.cores); // threads that build the scene inherit the affinity
    // By default one thread per core that rendering may use.
    const std::size_t render_threads = config.render.threads > 0
                                           ? static_cast<std::size_t>(config.render.threads)
                                           : threads.render.cores.count();
    renderer::RenderSettings settings = render_settings(config, render_threads);
    settings.enter_worker = [render = threads.render] { enter_render_worker(render); };
    settings.wait_for_tiles = wait_for_tiles;
    settings.enter_loader = [tiles = threads.tiles] { enter_thread("tiles", tiles); };
    settings.loader_share = threads.tiles_share;
    if (threads.render.share < 1)
        settings.before_row = [share = threads.render.share](bool first) { rest_before_row(share, first); };
    renderer::set_detector_response(scene, config.sensor.detector.quantum_efficiency);
    return std::make_unique<renderer::Renderer>(std::move(scene), std::move(settings));
}

namespace {

/// Refuses frames that do not fit, with figures, before the kernel kills what touches their pages.
void require_pool_memory(const DaemonConfig& config, std::size_t frames, std::size_t pixels,
                         std::size_t rows) {
    try {
        require_memory(frames * (pixels * sizeof(std::uint16_t) + rows * sizeof(RowTime)),
                       fmt::format("{}: daemon.pool_frames = {}: {} frames of {} x {} pixels{}",
                                   config.source.string(), config.daemon.pool_frames, frames,
                                   config.sensor.readout.width, rows,
                                   frames > static_cast<std::size_t>(config.daemon.pool_frames)
                                       ? ", with those that other programs may hold"
                                       : ""));
    } catch (const InputError& error) { // of this machine, not of a file
        throw HardwareError(error.what());
    }
}

} // namespace

Imaging::Imaging(const emulator::DaemonConfig& config, std::size_t pool_frames, const ThreadPlan& threads,
                 KeptTruth truth, RenderAhead ahead, bool real_time) {
    const InitialCamera initial = initial_camera(config);
    camera.initial = initial.settings;
    camera.limits = initial.limits;
    camera.scene = scene_clock_settings(config);
    // Offline there are no edges: they come at nominal times, from the scene's epoch on.
    SceneClockSettings nominal = camera.scene;
    if (nominal.mode == SceneTime::tai || nominal.mode == SceneTime::clock) nominal.mode = SceneTime::nominal;
    nominal_scene = SceneClock(std::move(nominal));
    camera.trigger_rate = nominal_trigger_rate(config);
    camera.over_trigger = config.trigger.over_trigger;
    if (const std::string complaint = explain_invalid(camera.initial, camera.limits); !complaint.empty())
        throw ConfigError(fmt::format("{}: camera: {}", config.source.string(), complaint));

    camera.thread = threads.pipeline;
    camera.trigger_thread = threads.trigger;
    camera.render = threads.render;

    scene::Scene scene = config.scene;
    if (config.simulator.enabled)
        poses = attach_pose_rings(scene, config.simulator.max_extrapolation_ms * 1e-3);
    renderer = make_renderer(config, std::move(scene), threads, !real_time);
    detector = std::make_unique<sensors::Detector>(config.sensor, config.scene.bands,
                                                   config.scene.camera.aperture_m, config.daemon.seed);
    // In lockstep time comes with the trigger; and of more bodies and lamps poses are not compared.
    const bool lockstep = std::any_of(config.trigger.lines.begin(), config.trigger.lines.end(),
                                      [](const auto& line) { return line.source == "lockstep"; });
    camera.expects_frames =
        !lockstep && !(config.simulator.enabled && (config.scene.bodies.size() > max_truth_bodies ||
                                                    config.scene.lamps.size() > RenderThread::max_lamps));
    camera.ahead_tolerance_px = config.render.ahead_tolerance_px;
    camera.max_ahead_ns = std::llround(config.render.ahead_ms * 1e6);
    // Other scenes show what they must, whenever the edge comes.
    const bool reprojects = camera.expects_frames && ahead == RenderAhead::automatic &&
                            (config.simulator.enabled || camera.scene.mode == SceneTime::clock ||
                             camera.scene.mode == SceneTime::tai);
    std::function<void()> enter_render;
    const bool adapts = real_time && config.deadline.quality == QualityPolicy::adapt && !lockstep &&
                        config.camera.readout_timing == ReadoutTiming::sensor;
    // Rendering to deadlines needs a thread of its own, whether ahead or not.
    camera.expects_frames = camera.expects_frames && ahead == RenderAhead::automatic;
    if (ahead == RenderAhead::automatic || adapts)
        enter_render = [render = threads.render] {
            enter_thread("render", {0, render.cores});
            schedule_this_thread(render);
        };
    maker = std::make_unique<FrameMaker>(
        *renderer, *detector, config.sensor, clock,
        FrameMakerSettings{.band_rows = config.render.band_rows,
                           .max_rows = camera.limits.rows_max,
                           .seed = config.daemon.seed,
                           .thread = threads.detector,
                           .run = run_word(config),
                           .same_run = config.daemon.run >= 0,
                           .scene_truth = truth.scene_entries > 0,
                           .live_poses = config.simulator.enabled,
                           .reprojects = reprojects,
                           .adapts = adapts,
                           .reserve_ns = std::llround(1e3 * config.deadline.reserve_us),
                           .floor = config.deadline.floor,
                           .real_time = real_time,
                           .max_pose_age_s =
                               config.simulator.enabled ? config.simulator.max_extrapolation_ms * 1e-3 : 0,
                           .target_error = config.render.target_error,
                           .enter_render = enter_render});
    if (const std::string complaint = maker->answer(camera.initial).refusal; !complaint.empty())
        throw ConfigError(fmt::format("{}: camera: {}", config.source.string(), complaint));
    sensor_columns_ = config.sensor.readout.width;
    sensor_rows_ = config.sensor.readout.height;
    adapts_ = adapts;
    min_reserve_ns_ = std::llround(1e3 * config.deadline.reserve_us);
    const auto rows = static_cast<std::size_t>(camera.limits.rows_max);
    const std::size_t pixels = rows * static_cast<std::size_t>(config.sensor.readout.width);
    require_pool_memory(config, pool_frames, pixels, rows);
    pool = std::make_unique<FramePool>(pool_frames, pixels, rows, truth);
}

std::vector<RowTime> Imaging::first_rows(std::int64_t exposure_ns) const {
    SceneClock scene(camera.scene);
    const Time now = clock.now();
    scene.begin(now);
    const SceneClock::Instant first = scene.at({.edge = now, .tai_offset_ns = clock.tai_offset_ns()});
    const Time shown = first.shown.at(first.planned);
    return std::vector<RowTime>(static_cast<std::size_t>(sensor_rows_), RowTime{shown, shown + exposure_ns});
}

renderer::RenderRequest Imaging::whole_sensor(std::span<const RowTime> rows) const {
    renderer::RenderRequest request;
    request.window = {0, 0, sensor_columns_, sensor_rows_};
    request.rows = sensor_rows_;
    request.row_times = rows;
    request.frame_id = 1;
    return request;
}

bool Imaging::load_tiles(const renderer::Renderer& of, const std::function<bool(double)>& go_on) const {
    const std::vector<RowTime> rows = first_rows(0);
    return of.load_tiles(whole_sensor(rows), go_on);
}

bool Imaging::measure_speed(const std::function<bool(double)>& go_on) {
    if (!adapts_) return true;
    const std::vector<RowTime> rows = first_rows(camera.initial.exposure_ns);
    renderer::RenderRequest request = whole_sensor(rows);
    request.common_mid = renderer::common_mid(rows);
    const std::optional<std::int64_t> frame_ns = frame_time_ns(*renderer, request, clock, go_on);
    if (!frame_ns) return false;
    const std::int64_t period_ns = std::llround(static_cast<double>(ns_per_s) / camera.trigger_rate.hz());
    const std::int64_t reserve_ns = reserve_for(*frame_ns, period_ns, min_reserve_ns_);
    maker->set_render_speed(*frame_ns, reserve_ns);
    log_info("rendering: a frame takes {:.1f} ms at full quality, {:.1f} ms are kept in reserve",
             to_seconds(*frame_ns) * 1e3, to_seconds(reserve_ns) * 1e3);
    return true;
}

void Imaging::catch_up(std::uint64_t first, const LevelsOf& levels) {
    std::uint64_t exposed_from = first - std::min(first - 1, detector->lag_frames());
    // Rows may be made of an earlier frame.
    const auto whole = [&](std::uint64_t id) {
        const std::span<const QualityLevel> own = levels ? levels(id) : std::span<const QualityLevel>{};
        return std::all_of(own.begin(), own.end(),
                           [](QualityLevel level) { return level < QualityLevel::reprojected; });
    };
    while (exposed_from > 1 && !whole(exposed_from))
        --exposed_from;
    for (std::uint64_t id = 1; id < exposed_from; ++id) {
        maker->skip(nominal_order(id));
        // The timing of a frame that begins after the readout of the frame before does not depend on it.
        if (!maker->overlaps(nominal_order(id + 1).scene_time + camera.initial.trigger_delay_ns)) break;
    }
    for (std::uint64_t id = exposed_from; id < first; ++id) {
        if (levels) maker->set_levels(levels(id));
        const FrameRef frame = pool->acquire();
        if (const std::string refusal = maker->make(nominal_order(id), *frame); !refusal.empty())
            throw ConfigError(refusal);
    }
}

FrameOrder Imaging::nominal_order(std::uint64_t frame_id) const {
    FrameOrder order;
    order.frame_id = order.trigger_id = frame_id;
    order.settings = camera.initial;
    const Time nominal = nominal_scene_time(camera.initial, camera.trigger_rate, frame_id);
    order.trigger_edge = order.seen = nominal;
    const SceneClock::Instant instant =
        nominal_scene.at({.frame_id = frame_id, .nominal = nominal, .edge = nominal});
    order.scene_time = instant.planned;
    order.shown = instant.shown;
    return order;
}

std::vector<std::unique_ptr<transports::Transport>>
make_transports(const DaemonConfig& config, CameraControl& control, const Clock& clock,
                const ThreadPlan& threads, std::function<PtpStatus()> ptp_status,
                transports::ControlListener* listener,
                std::shared_ptr<const images::SharedCards> camera_cards) {
    transports::ConfiguredTransports configured = config.transports;
    configured.get<transports::FileSinkSettings>().camera_cards = std::move(camera_cards);
    const transports::TransportContext context{.control = control,
                                               .clock = clock,
                                               .sensor = {config.sensor.readout.width,
                                                          config.sensor.readout.height,
                                                          config.sensor.detector.adc_bits},
                                               .transmit = threads.transmit,
                                               .display = threads.display,
                                               .seed = config.daemon.seed,
                                               .trigger_rate_hz = config.trigger.lines[0].rate_hz,
                                               .configuration = config.source.string(),
                                               .ptp_status = std::move(ptp_status),
                                               .control_listener = listener};
    return configured.make(context);
}

std::size_t frames_needed(const DaemonConfig& config) {
    // The pipeline's, and the last one, under deadline.policy "repeat", which may be chosen while running.
    return Releaser::frames_in_flight + 2 + config.transports.frames_held();
}

} // namespace obscura::emulator
