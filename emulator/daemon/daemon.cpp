// SPDX-License-Identifier: Apache-2.0
#include "emulator/daemon/daemon.hpp"

#include "core/error.hpp"
#include "core/realtime/realtime.hpp"
#include "emulator/config/configuration_entries.hpp"
#include "emulator/unit/reload.hpp"
#include "sync/inputs/pps_trigger.hpp"
#include "sync/settings.hpp"
#include "sync/software.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace obscura::emulator {

ClockState Daemon::TriggerLine::clock_state() const {
    return source ? source->clock_state(units.front()->clock().now()) : ClockState::free;
}

bool Daemon::TriggerLine::lockstep() const {
    return dynamic_cast<const sync::SoftwareTrigger*>(source.get()) != nullptr;
}

std::optional<std::int64_t> Daemon::TriggerLine::offset_ns() const {
    const auto* const pps = dynamic_cast<const sync::PpsTrigger*>(source.get());
    return pps != nullptr ? pps->offset_ns() : std::nullopt;
}

void Daemon::TriggerLine::let_step(bool with_source) const {
    if (number > 0) return;
    for (CameraUnit* unit : units)
        unit->step_with(with_source ? dynamic_cast<sync::SoftwareTrigger*>(source.get()) : nullptr);
}

Daemon::Daemon(emulator::DaemonConfig config) : config_(std::move(config)) {
    threads_ = granted_threads(config_);
    const std::vector<const emulator::DaemonConfig*> cameras = config_.cameras();
    if (config_.ptp.enabled) ptp_ = std::make_unique<sync::PtpMonitor>(sync::monitor_settings(config_.ptp));
    for (const emulator::DaemonConfig* camera : cameras)
        units_.push_back(std::make_unique<CameraUnit>(*camera, threads_, log_, ptp_.get()));
    const TaiCorrection tai = tai_.refresh(0);
    for (const auto& unit : units_)
        unit->set_tai_correction(tai);
    for (std::size_t i = 0; i < units_.size(); ++i)
        log_info("camera {}: run word {}{}", i, units_[i]->run(),
                 config_.daemon.run < 0 ? ", the next one at each further acquisition" : "");
    for (std::size_t number = 0; number < line_count; ++number)
        wire(number, cameras);
    note_configuration();
}

void Daemon::note_configuration() {
    const std::string sha256 = configuration_sha256(configuration_entries(config_));
    configured_utc_s_ =
        std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
    log_info("configuration: sha256 {}", sha256);
    const std::lock_guard lock(sha256_mutex_);
    config_sha256_ = sha256;
}

std::string Daemon::config_sha256() const {
    const std::lock_guard lock(sha256_mutex_);
    return config_sha256_;
}

std::optional<PtpStatus> Daemon::ptp_status() const {
    return ptp_ ? std::optional(ptp_->status()) : std::nullopt;
}

void Daemon::wire(std::size_t number, const std::vector<const emulator::DaemonConfig*>& cameras) {
    // Cameras without a [trigger] of their own share one; a further line is shared by all cameras with the
    // same settings of it.
    const auto shares = [&](const TriggerLine& line, const emulator::DaemonConfig& camera) {
        const emulator::DaemonConfig& other = *cameras[line.config];
        if (line.number != number) return false;
        return number == 0 ? !camera.own_trigger && !other.own_trigger
                           : camera.trigger.lines[number] == other.trigger.lines[number];
    };
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        const sync::TriggerLineSettings& settings = cameras[i]->trigger.lines[number];
        if (number > 0 && !settings.connected()) continue;
        const auto shared = std::find_if(lines_.begin(), lines_.end(),
                                         [&](const auto& line) { return shares(*line, *cameras[i]); });
        TriggerLine* line = shared != lines_.end() ? shared->get() : nullptr;
        if (line == nullptr) {
            line = lines_.emplace_back(std::make_unique<TriggerLine>()).get();
            line->number = number;
            line->config = i;
            line->conditioner =
                std::make_unique<sync::Conditioner>(sync::conditioner_settings(settings), line->cameras);
            line->source = sync::make_source(settings, units_[i]->clock(), threads_.trigger);
        }
        line->cameras.add(units_[i]->camera().line(number));
        line->units.push_back(units_[i].get());
    }
}

Daemon::~Daemon() {
    stop();
}

bool Daemon::load_tiles(const GoOn& go_on) {
    const auto count = static_cast<double>(units_.size());
    for (std::size_t i = 0; i < units_.size(); ++i)
        if (!units_[i]->load_tiles([&](const char* step, double share) {
                return go_on(step, (static_cast<double>(i) + share) / count);
            }))
            return false;
    return true;
}

void Daemon::start() {
    if (highest_priority(threads_) > 0) {
        const RealtimeGrant locked = lock_memory();
        if (locked.granted)
            log_info("real time: SCHED_FIFO and locked memory");
        else if (config_.daemon.realtime == RealtimeMode::required)
            throw HardwareError(fmt::format("daemon.realtime: \"required\", but {}", locked.why));
        else
            log_warning("real time: SCHED_FIFO, but memory can be paged out ({})", locked.why);
    }
    set_session_nice(threads_.render.nice);
    running_ = true;
    try {
        for (const auto& unit : units_)
            unit->start();
        for (const auto& line : lines_)
            if (line->source) line->source->start(*line->conditioner);
        for (const auto& line : lines_)
            line->let_step(true);
    } catch (...) {
        stop();
        throw;
    }
    for (const auto& unit : units_)
        unit->begin();
}

void Daemon::stop() {
    if (!std::exchange(running_, false)) return;
    for (const auto& line : lines_)
        line->let_step(false);
    for (const auto& line : lines_)
        if (line->source) line->source->stop();
    for (auto unit = units_.rbegin(); unit != units_.rend(); ++unit)
        (*unit)->stop();
    tick();
}

std::string Daemon::reload(emulator::DaemonConfig next, const std::function<bool()>& meanwhile) {
    std::string refused;
    const std::vector<std::string> changed = changed_keys(config_, next);
    for (const std::string& key : changed)
        if (!is_reloadable(key)) refused += (refused.empty() ? "" : ", ") + key;
    if (!refused.empty()) return fmt::format("{} cannot change while running; restart for that", refused);
    const std::vector<const emulator::DaemonConfig*> cameras = next.cameras();

    // Apply first what may fail: scenes, then trigger sources. The rest cannot fail.
    try {
        for (std::size_t i = 0; i < units_.size() && refused.empty(); ++i)
            refused = units_[i]->prepare(*cameras[i], meanwhile);
        const bool new_clock = std::any_of(changed.begin(), changed.end(), [](const std::string& key) {
            return key.rfind("trigger.", 0) == 0;
        });
        for (const auto& line : lines_)
            // A camera's own trigger is not among the reloadable keys.
            if (refused.empty() && new_clock && line->number == 0 && !cameras[line->config]->own_trigger)
                replace_trigger(*line, *cameras[line->config]);
    } catch (...) {
        for (const auto& unit : units_)
            unit->dismiss();
        throw;
    }
    for (std::size_t i = 0; i < units_.size(); ++i)
        if (refused.empty())
            units_[i]->apply_reload(*cameras[i]);
        else
            units_[i]->dismiss();
    if (!refused.empty()) return refused;
    config_ = std::move(next);
    note_configuration();
    return {};
}

void Daemon::replace_trigger(TriggerLine& line, const emulator::DaemonConfig& camera) {
    auto conditioner = std::make_unique<sync::Conditioner>(
        sync::conditioner_settings(camera.trigger.lines[0]), line.cameras);
    auto source = sync::make_source(camera.trigger.lines[0], units_[line.config]->clock(), threads_.trigger);
    const sync::RationalRate rate = nominal_trigger_rate(camera);
    line.let_step(false);
    if (line.source) line.source->stop();
    try {
        // The old source is stopped by now, because both may use the same line or socket.
        if (source) source->start(*conditioner);
    } catch (...) {
        if (line.source) line.source->start(*line.conditioner);
        line.let_step(true);
        throw;
    }
    line.source = std::move(source);
    line.conditioner = std::move(conditioner);
    line.let_step(true);
    for (CameraUnit* unit : line.units)
        unit->camera().set_trigger_rate(rate);
}

void Daemon::release_control() {
    for (const auto& unit : units_)
        unit->release_control();
}

std::string Daemon::address() const {
    std::string all;
    for (const auto& unit : units_)
        all += (all.empty() ? "" : " ") + unit->address();
    return all;
}

void Daemon::tick() {
    log_.drain();
    publish_clock_states();
    report_refused_triggers();
    const TaiCorrection tai = tai_.refresh(ptp_ ? ptp_->tai_correction_ns() : 0);
    for (const auto& unit : units_) {
        unit->set_tai_correction(tai);
        unit->tick();
    }
}

void Daemon::write_timing_to(const std::filesystem::path& file, std::size_t camera) {
    units_.at(camera)->write_timing_to(file);
}

std::uint64_t Daemon::lost_timing_rows() const noexcept {
    std::uint64_t lost = 0;
    for (const auto& unit : units_)
        lost += unit->lost_timing_rows();
    return lost;
}

void Daemon::publish_clock_states() {
    if (!running_) return;
    for (const auto& line : lines_) {
        const ClockState state = line->clock_state();
        if (std::exchange(line->clock, state) == state) continue;
        if (state == ClockState::locked)
            log_notice("clock: {} ({})", name_of(state), line->source_name());
        else
            log_warning("clock: {} ({})", name_of(state), line->source_name());
    }
}

void Daemon::report_refused_triggers() {
    for (const auto& line : lines_) {
        if (line->refusal_logged || line->refused() == 0) continue;
        line->refusal_logged = true;
        log_warning("trigger {}: message dropped and counted as refused: no trigger, or beyond max_rate_hz",
                    line->source_name());
    }
}

Heartbeats Daemon::heartbeats() const {
    Heartbeats all;
    const auto add = [&all](const Heartbeats& more) { all.insert(all.end(), more.begin(), more.end()); };
    for (const auto& unit : units_)
        add(unit->heartbeats());
    for (const auto& line : lines_)
        if (line->source) add(line->source->heartbeats());
    if (ptp_) all.push_back(&ptp_->heartbeat());
    return all;
}

bool Daemon::alive() {
    bool moves = true;
    for (const auto& unit : units_)
        moves = unit->camera().alive() && moves;
    const Time now = units_.front()->clock().now();
    const bool alive = supervisor_.all_alive(heartbeats(), moves, now);
    if (alive) {
        last_alive_ = now;
        silence_reported_ = false;
    } else if (now - last_alive_ > ns_per_s && !std::exchange(silence_reported_, true)) {
        log_error("watchdog: no heartbeat from {}", supervisor_.missed());
    }
    return alive;
}

std::string Daemon::summary() const {
    if (units_.size() == 1) return units_.front()->summary();
    std::string lines;
    for (std::size_t i = 0; i < units_.size(); ++i)
        lines += fmt::format("{}camera[{}] {}: {}", i == 0 ? "" : " | ", i, units_[i]->address(),
                             units_[i]->summary());
    return lines;
}

nlohmann::ordered_json Daemon::statistics_of(std::size_t camera) const {
    for (const auto& line : lines_)
        for (const CameraUnit* one : line->units)
            if (one == units_.at(camera).get())
                return one->statistics({.name = line->source_name(),
                                        .clock = line->clock_state(),
                                        .lockstep = line->lockstep(),
                                        .refused = line->refused(),
                                        .offset_ns = line->offset_ns()});
    return units_.at(camera)->statistics({});
}

std::string Daemon::statistics_json() const {
    if (units_.size() == 1) return statistics_of(0).dump(2) + "\n";
    nlohmann::ordered_json json;
    json["cameras"] = nlohmann::ordered_json::array();
    for (std::size_t i = 0; i < units_.size(); ++i) {
        nlohmann::ordered_json one = statistics_of(i);
        one["address"] = units_[i]->address();
        json["cameras"].push_back(std::move(one));
    }
    return json.dump(2) + "\n";
}

} // namespace obscura::emulator
