#include "emulator/camera_unit.hpp"

#include "emulator/statistics.hpp"
#include "transports/gige/gige.hpp"

#include <fmt/format.h>

#include <cmath>
#include <ostream>

namespace obscura::emulator {
namespace {

LatePolicy late_policy(const std::string& name) {
    if (name == "repeat") return LatePolicy::repeat;
    if (name == "drop") return LatePolicy::drop;
    if (name == "partial") return LatePolicy::partial;
    return LatePolicy::late;
}

} // namespace

CameraUnit::CameraUnit(const config::Config& config, const Priorities& priorities, LogRing& log,
                       const sync::PtpMonitor* ptp)
    : begins_at_once_(config.daemon.autostart || !config.gige.enabled), gige_port_(config.gige.port) {
    auto frames = static_cast<std::size_t>(config.daemon.pool_frames);
    if (const std::size_t needed = frames_needed(config); frames < needed) {
        log_warning("daemon.pool_frames: {} frames are fewer than the transports may hold; using {}", frames,
                    needed);
        frames = needed;
    }
    imaging_ =
        std::make_unique<Imaging>(config, frames, priorities, config.file.enabled && config.file.truth);
    ReleaserSettings release;
    release.max_rows = imaging_->pool->max_rows();
    release.priority = priorities.release;
    release.policy = late_policy(config.deadline.policy);
    release.grace_ns = std::llround(config.deadline.grace_us * 1e3);
    // Polling without SCHED_FIFO only takes time from those who have work to do.
    if (release.priority > 0) release.spin_ns = std::llround(config.deadline.spin_us * 1e3);
    releaser_ = std::make_unique<Releaser>(release, std::make_unique<MonotonicClock>(), &timing_);
    camera_ = std::make_unique<Camera>(imaging_->camera, *imaging_->maker, *releaser_, *imaging_->pool,
                                       imaging_->clock, log);
    transports_ = make_transports(config, *camera_, imaging_->clock, priorities);
    for (const auto& transport : transports_) {
        camera_->add_transport(*transport);
        if (auto* gige = dynamic_cast<transports::gige::GigeCamera*>(transport.get());
            gige != nullptr && ptp != nullptr)
            gige->set_ptp([ptp] { return ptp->status(); });
    }
}

CameraUnit::~CameraUnit() {
    // Transports let go of their frames before camera, releaser and pool go.
    transports_.clear();
}

void CameraUnit::start() {
    for (const auto& transport : transports_)
        transport->start();
    for (const auto& transport : transports_)
        if (const auto* gige = dynamic_cast<const transports::gige::GigeCamera*>(transport.get()))
            address_ = fmt::format("{}:{}", gige->address(), gige_port_);
}

void CameraUnit::begin() {
    if (begins_at_once_) camera_->acquisition_start();
}

void CameraUnit::stop() {
    camera_->acquisition_stop(true);
    for (auto transport = transports_.rbegin(); transport != transports_.rend(); ++transport)
        (*transport)->stop();
}

void CameraUnit::tick() {
    if (timing_out_ != nullptr)
        timing_.drain(*timing_out_);
    else
        timing_.discard();
}

void CameraUnit::write_timing_to(std::ostream& out) {
    out << TimingLog::header();
    timing_out_ = &out;
}

std::string CameraUnit::summary() const {
    return summary_line(*camera_, transports_);
}

std::string CameraUnit::statistics_json() const {
    return statistics_to_json(*camera_, *releaser_, transports_);
}

} // namespace obscura::emulator
