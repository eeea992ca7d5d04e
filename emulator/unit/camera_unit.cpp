// SPDX-License-Identifier: Apache-2.0
#include "emulator/unit/camera_unit.hpp"

#include "core/io/stop_reading.hpp"
#include "core/text/printable.hpp"
#include "emulator/render/render_faults.hpp"
#include "emulator/unit/reload.hpp"
#include "renderer/camera/lens_cards.hpp"
#include "renderer/world/model_warnings.hpp"
#include "renderer/world/pose_age.hpp"
#include "renderer/world/preset_range.hpp"
#include "sensors/sensor_model.hpp"
#include "service/failure.hpp"
#include "service/tokens.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <future>
#include <iterator>
#include <optional>
#include <ostream>
#include <utility>

namespace obscura::emulator {
namespace {

// Delay between the last row of a frame and the writing of its time stamps, so that its transports have
// finished.
constexpr std::int64_t transports_done_ns = 500 * ns_per_ms;

constexpr std::size_t recent_timing_rows = 1024;

std::optional<service::Token> simulator_token(const SimulatorSection& simulator) {
    if (simulator.token_file.empty()) return std::nullopt;
    return service::read_token_file(simulator.token_file);
}

} // namespace

CameraUnit::CameraUnit(const emulator::DaemonConfig& config, const ThreadPlan& threads, LogRing& log,
                       const sync::PtpMonitor* ptp)
    : uncontrolled_(!config.transports.controls_acquisition()),
      threads_(threads),
      recent_timing_(timing_, config.control.enabled() ? recent_timing_rows : 0) {
    auto frames = static_cast<std::size_t>(config.daemon.pool_frames);
    if (const std::size_t needed = frames_needed(config); frames < needed) {
        log_warning("daemon.pool_frames: {} frames are fewer than the transports may hold; using {}", frames,
                    needed);
        frames = needed;
    }
    if (config.monitor.keeps_frames() || config.control.enabled())
        frames += transports::WatchTransport::frames_held;
    imaging_ = std::make_unique<Imaging>(config, frames, threads, config.transports.kept_truth(),
                                         config.render.ahead, true);
    overlays_ =
        std::make_unique<FrameOverlays>(config.sensor, *imaging_->detector, config.scene.camera.aperture_m);
    scene_fingerprint_ = scene_fingerprint(config.scene_file, models_folder(config.models));
    probe_settings_ = std::make_shared<const ProbeSettings>(probe_settings(config));
    ReleaserSettings release;
    release.max_rows = imaging_->pool->max_rows();
    release.timing = config.camera.readout_timing;
    release.thread = threads.release;
    release.policy = config.deadline.policy;
    release.grace_ns = std::llround(config.deadline.grace_us * 1e3);
    // Without SCHED_FIFO polling only takes CPU time from other threads.
    if (release.thread.priority > 0) release.spin_ns = std::llround(config.deadline.spin_us * 1e3);
    if (config.control.enabled()) timing_.keep_rows(imaging_->pool->max_rows());
    releaser_ = std::make_unique<Releaser>(release, std::make_unique<MonotonicClock>(), &timing_);
    camera_ = std::make_unique<Camera>(imaging_->camera, *imaging_->maker, *releaser_, *imaging_->pool,
                                       imaging_->clock, log);
    std::function<PtpStatus()> ptp_status;
    if (ptp != nullptr) ptp_status = [ptp] { return ptp->status(); };
    if (config.daemon.autostart && !uncontrolled_) autostart_ = std::make_unique<Autostart>(*camera_);
    lens_cards_ =
        std::make_shared<images::SharedCards>(renderer::lens_cards(imaging_->renderer->scene().camera));
    transports_ = make_transports(config, *camera_, imaging_->clock, threads, std::move(ptp_status),
                                  autostart_.get(), lens_cards_);
    if (config.control.enabled() || config.monitor.keeps_frames()) {
        try {
            auto watch = std::make_unique<transports::WatchTransport>(
                static_cast<std::size_t>(imaging_->camera.limits.rows_max) *
                    static_cast<std::size_t>(imaging_->camera.limits.sensor_width),
                [cores = ordinary_cores(threads)] { enter_client_thread("watch", cores); });
            watch_ = watch.get();
            transports_.push_back(std::move(watch));
        } catch (const HardwareError& error) {
            log_warning("monitor.frames: frame ring unavailable: {}", error.what());
        }
    }
    std::vector<std::string> kinds;
    for (const auto& transport : transports_) {
        if (transport.get() == watch_) { // nothing leaves by it
            camera_->add_viewers(*transport);
            continue;
        }
        camera_->add_transport(*transport);
        kinds.emplace_back(transport->kind());
    }
    timing_.set_transports(std::move(kinds));
    timing_.set_render(render_facts(config, threads));
    if (config.simulator.enabled)
        simulator_ = std::make_unique<SimulatorServer>(config.simulator.listen, imaging_->poses, *camera_,
                                                       imaging_->clock, threads.render,
                                                       simulator_token(config.simulator));
    const auto line = [low = config.outputs.active_low](const char* key, const std::string& name) {
        return [=]() -> std::unique_ptr<sync::OutputLine> {
            return name.empty() ? nullptr : sync::open_gpio_output(key, name, low);
        };
    };
    outputs_ = std::make_unique<OutputLines>(*camera_, imaging_->clock, threads.trigger,
                                             line("outputs.trigger_ready", config.outputs.trigger_ready),
                                             line("outputs.exposure", config.outputs.exposure));
}

CameraUnit::~CameraUnit() {
    // Destroy the transports first: they release their frames before camera, releaser and pool are destroyed.
    transports_.clear();
}

bool CameraUnit::load_tiles(const GoOn& go_on) {
    const renderer::Renderer& renderer = *imaging_->renderer;
    const std::uint64_t before = renderer.tiles_made();
    const Time began = imaging_->clock.now();
    if (!imaging_->load_tiles(renderer, [&](double share) { return go_on("tiles", share); })) return false;
    if (const std::uint64_t made = renderer.tiles_made() - before; made > 0)
        log_info("tiles: {} made for the first frame in {:.1f} s", made,
                 to_seconds(imaging_->clock.now() - began));
    return imaging_->measure_speed([&](double share) { return go_on("first frame", share); });
}

void CameraUnit::start() {
    for (const auto& transport : transports_)
        transport->start();
    for (const auto& transport : transports_)
        if (std::string address = transport->control_address(); !address.empty())
            address_ = std::move(address);
    outputs_->start();
    if (simulator_) simulator_->start();
}

void CameraUnit::begin() {
    if (uncontrolled_) camera_->acquisition_start();
    if (autostart_) autostart_->begin(address_);
}

void CameraUnit::stop() {
    if (autostart_) autostart_->end();
    if (simulator_) simulator_->stop();
    camera_->acquisition_stop(true);
    for (auto transport = transports_.rbegin(); transport != transports_.rend(); ++transport)
        (*transport)->stop();
    outputs_->stop();
    stopped_ = true;
}

void CameraUnit::step_with(sync::SoftwareTrigger* source) {
    if (simulator_) simulator_->step_with(source);
}

std::string CameraUnit::prepare(const emulator::DaemonConfig& next, const std::function<bool()>& meanwhile) {
    next_fingerprint_ = scene_fingerprint(next.scene_file, models_folder(next.models));
    if (next_fingerprint_ == scene_fingerprint_) return {};
    if (std::string why = scene_refusal(imaging_->renderer->scene(), next); !why.empty()) return why;
    std::atomic<bool> stop{false};
    bool loaded = false;
    const StopReading stop_reading([&] { return stop.load(); });
    auto built = std::async(std::launch::async, [&] {
        auto renderer = make_renderer(next, next.scene, threads_, false);
        loaded = imaging_->load_tiles(*renderer, [&](double) { return !stop; });
        return renderer;
    });
    while (built.wait_for(std::chrono::milliseconds(100)) != std::future_status::ready)
        if (meanwhile && !meanwhile()) stop = true;
    next_renderer_ = built.get();
    return loaded ? "" : "stopped while tiles were made";
}

void CameraUnit::apply_reload(const emulator::DaemonConfig& next) {
    releaser_->set_late_policy(next.deadline.policy, std::llround(next.deadline.grace_us * 1e3));
    if (!next_renderer_) return;
    probed_scene_.reset();
    lens_cards_->set(renderer::lens_cards(next_renderer_->scene().camera));
    scene_fingerprint_ = next_fingerprint_;
    reported_ages_.clear();
    presets_judged_ = false;
    const std::lock_guard lock(scenes_);
    const Time since = std::exchange(shown_since_, imaging_->clock.now());
    imaging_->maker->replace_renderer(*next_renderer_);
    retired_.push_back({std::exchange(imaging_->renderer, std::move(next_renderer_)), since});
}

Heartbeats CameraUnit::heartbeats() const {
    Heartbeats all{&releaser_->heartbeat(), &outputs_->heartbeat(), &camera_->alarm_heartbeat()};
    if (simulator_) all.push_back(&simulator_->heartbeat());
    for (const auto& transport : transports_) {
        const Heartbeats more = transport->heartbeats();
        all.insert(all.end(), more.begin(), more.end());
    }
    return all;
}

void CameraUnit::report_pose_ages() {
    const std::optional<Time> at = camera_->scene_time();
    if (!at) return;
    if (!std::exchange(presets_judged_, true)) {
        for (const std::string& line : renderer::presets_out_of_range(scene(), imaging_->renderer->view(*at)))
            log_warning("material: {}", line);
        for (const std::string& line : renderer::model_warnings(scene()))
            log_warning("model: {}", line);
    }
    double largest_s = 0;
    for (const renderer::AgedPoses& aged : renderer::aged_poses(scene(), to_seconds(at->ns))) {
        largest_s = std::max(largest_s, aged.age_s);
        if (std::find(reported_ages_.begin(), reported_ages_.end(), aged.key) != reported_ages_.end())
            continue;
        reported_ages_.push_back(aged.key);
        log_warning("scene time: {}", aged.text());
    }
    pose_age_s_.store(largest_s, std::memory_order_relaxed);
}

void CameraUnit::report_render_faults() {
    constexpr std::int64_t works_after_ns = 10 * ns_per_s;
    RenderFaults& faults = imaging_->maker->faults();
    const Time now = imaging_->clock.now();
    if (const std::uint64_t count = faults.count(); count != faults_seen_) {
        faults_seen_ = count;
        const std::string what = faults.take_text();
        if (std::exchange(fault_seen_, now) == Time{})
            log_error("rendering fails: {}; rows of such frames are black, and the frames are counted",
                      printable(what, 200));
    } else if (fault_seen_ != Time{} && now - fault_seen_ > works_after_ns) {
        fault_seen_ = Time{};
        log_notice("rendering works again; {} frames have black rows", imaging_->maker->failed_frames());
    }
}

void CameraUnit::report_sensor_model() {
    if (!std::exchange(sensor_judged_, true))
        for (const std::string& line : sensors::sensor_model_warnings(probe_settings_->sensor))
            log_warning("model: {}", line);
    if (replacing_seen_) return;
    const std::uint64_t count = imaging_->detector->values_replaced();
    if (count == 0) return;
    replacing_seen_ = true;
    log_warning(
        "the sensor's model gives values that are not numbers, or out of range: {} so far are replaced; they are counted",
        count);
}

void CameraUnit::tick() {
    report_pose_ages();
    report_render_faults();
    report_sensor_model();
    // The next frame may be rendered with the new scene while this one is made with the one before.
    if (const FrameMaker& maker = *imaging_->maker; !retired_.empty() && maker.uses(*imaging_->renderer)) {
        // Destroyed after the lock, which takes time.
        std::vector<Retired> unused;
        const std::lock_guard lock(scenes_);
        const auto first = std::partition(retired_.begin(), retired_.end(),
                                          [&maker](const Retired& r) { return maker.uses(*r.renderer); });
        std::move(first, retired_.end(), std::back_inserter(unused));
        retired_.erase(first, retired_.end());
    }
    std::vector<std::int64_t> pace_ns;
    for (const auto& transport : transports_)
        pace_ns.push_back(transport->pace_ns());
    const auto take = [&](const FrameTiming& frame) {
        recent_timing_.note(frame);
        if (timing_file_) timing_file_->add(timing_.row(frame, pace_ns));
    };
    timing_.drain(take, stopped_ ? Time{INT64_MAX} : imaging_->clock.now() - transports_done_ns);
    if (timing_file_) timing_file_->flush();
}

UndeliveredFrames CameraUnit::undelivered() const {
    UndeliveredFrames all;
    for (const auto& transport : transports_) {
        const std::uint64_t dropped = transport->delivers_all() ? transport->counters().dropped : 0;
        if (dropped == 0) continue;
        all.frames += dropped;
        all.by += fmt::format("{}{}", all.by.empty() ? "" : ", ", transport->kind());
    }
    return all;
}

void CameraUnit::write_timing_to(const std::filesystem::path& file) {
    timing_file_.emplace(file);
    timing_file_->add(timing_.header());
    timing_.keep_rows(imaging_->pool->max_rows());
}

void CameraUnit::run_between_commands(const transports::Transport::ControlWork& work) {
    for (const auto& transport : transports_)
        if (transport->run_between_commands(work)) return;
    const std::lock_guard lock(commands_);
    work({});
}

transports::FaultRules* CameraUnit::fault_rules() const noexcept {
    for (const auto& transport : transports_)
        if (transports::FaultRules* rules = transport->fault_rules()) return rules;
    return nullptr;
}

transports::DeviceFeatures* CameraUnit::device_features() const noexcept {
    for (const auto& transport : transports_)
        if (transports::DeviceFeatures* features = transport->device_features()) return features;
    return nullptr;
}

std::optional<FrameScene> CameraUnit::scene_of(const FrameInfo& frame) const {
    const auto origin = imaging_->maker->origins().find(frame.frame_id, frame.trigger_edge);
    if (!origin) return std::nullopt;
    const std::lock_guard lock(scenes_);
    const auto made = [&](const std::shared_ptr<renderer::Renderer>& renderer, Time since) {
        // Another renderer may have the address of one that is gone.
        return origin->renderer == renderer.get() && frame.pose >= since;
    };
    if (made(imaging_->renderer, shown_since_)) return FrameScene{imaging_->renderer, *origin};
    for (const Retired& retired : retired_)
        if (made(retired.renderer, retired.since)) return FrameScene{retired.renderer, *origin};
    return std::nullopt;
}

CameraUnit::ProbeSource CameraUnit::probe_source(const FrameInfo& frame) {
    const auto refuse = [&](const char* why) {
        return service::Failure(service::FailureCode::not_now,
                                fmt::format("probe: frame {} {}", frame.frame_id, why));
    };
    const auto origin = imaging_->maker->origins().find(frame.frame_id, frame.trigger_edge);
    if (!origin) throw refuse("is too old");
    // Another renderer may have the address of one that is gone.
    if (origin->renderer != imaging_->renderer.get() || frame.pose < shown_since_)
        throw refuse("shows a scene that is gone");
    auto scene = probed_scene_.lock();
    if (!scene) {
        scene = std::make_shared<const scene::Scene>(imaging_->renderer->scene());
        probed_scene_ = scene;
    }
    return {std::move(scene), probe_settings_, *origin};
}

std::optional<SimulatorCounters> CameraUnit::simulator_counters() const {
    if (!simulator_) return std::nullopt;
    return simulator_->counters();
}

void CameraUnit::release_control() {
    for (const auto& transport : transports_)
        transport->release_control();
}

std::string CameraUnit::controller() const {
    for (const auto& transport : transports_)
        if (std::string client = transport->controller(); !client.empty()) return client;
    return {};
}

std::string CameraUnit::summary() const {
    return summary_line(*camera_, transports_);
}

nlohmann::ordered_json CameraUnit::statistics(const SourceState& source) const {
    return statistics_json(*camera_, *releaser_, transports_, recent_timing_.stages(), source,
                           imaging_->maker->run());
}

} // namespace obscura::emulator
