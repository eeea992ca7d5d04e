#include "emulator/daemon.hpp"

#include "core/error.hpp"
#include "core/realtime.hpp"
#include "emulator/reload.hpp"
#include "emulator/statistics.hpp"
#include "transports/gige/gige.hpp"

#include <fmt/format.h>

#include <cmath>
#include <ostream>
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

LatePolicy late_policy(const std::string& name) {
    if (name == "repeat") return LatePolicy::repeat;
    if (name == "drop") return LatePolicy::drop;
    if (name == "partial") return LatePolicy::partial;
    return LatePolicy::late;
}

} // namespace

Daemon::Daemon(config::Config config) : config_(std::move(config)) {
    priorities_ = choose_priorities(config_.daemon.realtime);
    auto frames = static_cast<std::size_t>(config_.daemon.pool_frames);
    if (const std::size_t needed = frames_needed(config_); frames < needed) {
        log_warning("daemon.pool_frames: {} frames are fewer than the transports may hold; using {}", frames,
                    needed);
        frames = needed;
    }
    imaging_ = std::make_unique<Imaging>(config_, frames, priorities_);
    ReleaserSettings release;
    release.max_rows = static_cast<std::size_t>(config_.sensor.readout.height);
    release.priority = priorities_.release;
    release.policy = late_policy(config_.deadline.policy);
    release.grace_ns = std::llround(config_.deadline.grace_us * 1e3);
    // Polling without SCHED_FIFO only takes time from those who have work to do.
    if (release.priority > 0) release.spin_ns = std::llround(config_.deadline.spin_us * 1e3);
    releaser_ = std::make_unique<Releaser>(release, std::make_unique<MonotonicClock>(), &timing_);
    camera_ = std::make_unique<Camera>(imaging_->camera, *imaging_->maker, *releaser_, *imaging_->pool,
                                       imaging_->clock, log_);
    transports_ = make_transports(config_, *camera_, imaging_->clock, priorities_);
    for (const auto& transport : transports_)
        camera_->add_transport(*transport);
    conditioner_ = std::make_unique<sync::Conditioner>(conditioner_settings(config_), *camera_);
    source_ = make_trigger_source(config_, imaging_->clock, priorities_);
}

Daemon::~Daemon() {
    stop();
    // Transports let go of their frames before camera, releaser and pool go.
    transports_.clear();
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
        for (const auto& transport : transports_)
            transport->start();
        if (source_) source_->start(*conditioner_);
    } catch (...) {
        stop();
        throw;
    }
    for (const auto& transport : transports_)
        if (const auto* gige = dynamic_cast<const transports::gige::GigeCamera*>(transport.get()))
            address_ = fmt::format("{}:{}", gige->address(), config_.gige.port);
    if (config_.daemon.autostart || !config_.gige.enabled) camera_->acquisition_start();
}

void Daemon::stop() {
    if (!std::exchange(running_, false)) return;
    if (source_) source_->stop();
    camera_->acquisition_stop(true);
    for (auto transport = transports_.rbegin(); transport != transports_.rend(); ++transport)
        (*transport)->stop();
    tick();
}

std::string Daemon::reload(config::Config next) {
    std::string refused;
    const std::vector<std::string> changed = changed_keys(config_, next);
    for (const std::string& key : changed)
        if (!is_reloadable(key)) refused += (refused.empty() ? "" : ", ") + key;
    if (!refused.empty()) return fmt::format("{} cannot change while running; restart for that", refused);
    if (changed.empty()) return {};

    auto conditioner = std::make_unique<sync::Conditioner>(conditioner_settings(next), *camera_);
    auto source = make_trigger_source(next, imaging_->clock, priorities_);
    const sync::RationalRate rate = nominal_trigger_rate(next);
    if (source_) source_->stop();
    try {
        // Both may want the same line or socket, so the old one has to let go first.
        if (source) source->start(*conditioner);
    } catch (...) {
        if (source_) source_->start(*conditioner_);
        throw;
    }
    source_ = std::move(source);
    conditioner_ = std::move(conditioner);
    camera_->set_trigger_rate(rate);
    config_ = std::move(next);
    return {};
}

std::string Daemon::address() const {
    return address_;
}

void Daemon::tick() {
    log_.drain();
    if (timing_out_ != nullptr)
        timing_.drain(*timing_out_);
    else
        timing_.discard();
}

void Daemon::write_timing_to(std::ostream& out) {
    out << TimingLog::header();
    timing_out_ = &out;
}

bool Daemon::alive() {
    return camera_->alive();
}

std::string Daemon::summary() const {
    return summary_line(*camera_, transports_);
}

std::string Daemon::statistics_json() const {
    return statistics_to_json(*camera_, *releaser_, transports_);
}

} // namespace obscura::emulator
