#include "emulator/daemon.hpp"

#include "core/error.hpp"
#include "core/realtime.hpp"
#include "emulator/reload.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <utility>

namespace obscura::emulator {
namespace {

// Which priorities the threads get, with the reason in the log when they get none.
Priorities choose_priorities(const std::string& wish) {
    if (wish == "off") {
        log_info("real time: off, as configured; deadlines are met as well as ordinary scheduling allows");
        return {};
    }
    const RealtimeGrant grant = realtime_permitted(realtime_priorities.trigger);
    if (grant.granted) return realtime_priorities;
    if (wish == "required")
        throw HardwareError(fmt::format(
            "daemon.realtime: \"required\", but {}; allowed with \"auto\", CAP_SYS_NICE or LimitRTPRIO >= {}",
            grant.why, realtime_priorities.trigger));
    log_warning(
        "real time: not permitted ({}); running with ordinary scheduling, expect late frames on a busy "
        "machine",
        grant.why);
    return {};
}

} // namespace

Daemon::Daemon(config::Config config) : config_(std::move(config)) {
    priorities_ = choose_priorities(config_.daemon.realtime);
    const std::vector<const config::Config*> cameras = config_.cameras();
    if (config_.ptp.enabled) {
        sync::PtpMonitorSettings ptp;
        ptp.socket = config_.ptp.socket;
        ptp.domain = static_cast<std::uint8_t>(config_.ptp.domain);
        ptp.lock_ns = std::llround(config_.ptp.lock_us * 1e3);
        ptp_ = std::make_unique<sync::PtpMonitor>(ptp);
    }
    for (const config::Config* camera : cameras)
        units_.push_back(std::make_unique<CameraUnit>(*camera, priorities_, log_, ptp_.get()));
    // One line that all share who have none of their own.
    TriggerLine* shared = nullptr;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        TriggerLine* line = cameras[i]->own_trigger ? nullptr : shared;
        if (line == nullptr) {
            line = lines_.emplace_back(std::make_unique<TriggerLine>()).get();
            line->config = i;
            line->conditioner =
                std::make_unique<sync::Conditioner>(conditioner_settings(*cameras[i]), line->cameras);
            line->source = make_trigger_source(*cameras[i], units_[i]->clock(), priorities_);
            if (!cameras[i]->own_trigger) shared = line;
        }
        line->cameras.add(units_[i]->camera());
        line->units.push_back(units_[i].get());
    }
}

Daemon::~Daemon() {
    stop();
}

void Daemon::start() {
    if (priorities_.trigger > 0) {
        const RealtimeGrant locked = lock_memory();
        if (locked.granted)
            log_info("real time: SCHED_FIFO and locked memory");
        else if (config_.daemon.realtime == "required")
            throw HardwareError(fmt::format("daemon.realtime: \"required\", but {}", locked.why));
        else
            log_warning("real time: SCHED_FIFO, but memory can be paged out ({})", locked.why);
    }
    running_ = true;
    try {
        for (const auto& unit : units_)
            unit->start();
        for (const auto& line : lines_)
            if (line->source) line->source->start(*line->conditioner);
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
        if (line->source) line->source->stop();
    for (auto unit = units_.rbegin(); unit != units_.rend(); ++unit)
        (*unit)->stop();
    tick();
}

std::string Daemon::reload(config::Config next) {
    std::string refused;
    const std::vector<std::string> changed = changed_keys(config_, next);
    for (const std::string& key : changed)
        if (!is_reloadable(key)) refused += (refused.empty() ? "" : ", ") + key;
    if (!refused.empty()) return fmt::format("{} cannot change while running; restart for that", refused);
    if (changed.empty()) return {};

    for (const auto& line : lines_) {
        const config::Config& camera = *next.cameras()[line->config];
        if (camera.own_trigger) continue; // not among the reloadable keys
        auto conditioner = std::make_unique<sync::Conditioner>(conditioner_settings(camera), line->cameras);
        auto source = make_trigger_source(camera, units_[line->config]->clock(), priorities_);
        const sync::RationalRate rate = nominal_trigger_rate(camera);
        if (line->source) line->source->stop();
        try {
            // Both may want the same line or socket, so the old one has to let go first.
            if (source) source->start(*conditioner);
        } catch (...) {
            if (line->source) line->source->start(*line->conditioner);
            throw;
        }
        line->source = std::move(source);
        line->conditioner = std::move(conditioner);
        for (CameraUnit* unit : line->units)
            unit->camera().set_trigger_rate(rate);
    }
    config_ = std::move(next);
    return {};
}

std::string Daemon::address() const {
    std::string all;
    for (const auto& unit : units_)
        all += (all.empty() ? "" : " ") + unit->address();
    return all;
}

void Daemon::tick() {
    log_.drain();
    for (const auto& unit : units_) {
        if (ptp_) unit->set_tai_correction_ns(ptp_->tai_correction_ns());
        unit->tick();
    }
}

void Daemon::write_timing_to(std::ostream& out, std::size_t camera) {
    units_.at(camera)->write_timing_to(out);
}

bool Daemon::alive() {
    bool all = true;
    for (const auto& unit : units_)
        all = unit->camera().alive() && all;
    return all;
}

std::string Daemon::summary() const {
    if (units_.size() == 1) return units_.front()->summary();
    std::string lines;
    for (std::size_t i = 0; i < units_.size(); ++i)
        lines += fmt::format("{}camera[{}] {}: {}", i == 0 ? "" : " | ", i, units_[i]->address(),
                             units_[i]->summary());
    return lines;
}

std::string Daemon::statistics_json() const {
    if (units_.size() == 1) return units_.front()->statistics_json();
    nlohmann::ordered_json json;
    json["cameras"] = nlohmann::ordered_json::array();
    for (const auto& unit : units_) {
        nlohmann::ordered_json one = nlohmann::ordered_json::parse(unit->statistics_json());
        one["address"] = unit->address();
        json["cameras"].push_back(std::move(one));
    }
    return json.dump(2) + "\n";
}

} // namespace obscura::emulator
