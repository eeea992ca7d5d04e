// SPDX-License-Identifier: Apache-2.0
#include "emulator/camera/output_lines.hpp"

#include "core/error.hpp"
#include "core/realtime/log.hpp"

#include <algorithm>

namespace obscura::emulator {
namespace {

constexpr std::int64_t reopen_every_ns = 500 * ns_per_ms;

} // namespace

OutputLines::OutputLines(Camera& camera, const Clock& clock, const ThreadSettings& thread, Open ready,
                         Open exposure)
    : camera_(camera),
      clock_(clock),
      thread_settings_(thread),
      ready_{"outputs.trigger_ready", std::move(ready)},
      exposure_{"outputs.exposure", std::move(exposure)} {}

OutputLines::~OutputLines() {
    stop();
}

void OutputLines::start() {
    for (Line* line : {&ready_, &exposure_}) {
        line->line = line->open();
        line->wanted = line->line != nullptr;
        line->active = false;
    }
    stopping_ = false;
    if (!ready_.wanted && !exposure_.wanted) return;
    thread_ = std::thread([this] {
        enter_thread(heartbeat_.name().c_str(), thread_settings_);
        run();
    });
}

void OutputLines::stop() {
    if (thread_.joinable()) {
        stopping_ = true;
        camera_.moments_changed().notify();
        thread_.join();
        heartbeat_.rest();
    }
    ready_.line.reset();
    exposure_.line.reset();
}

void OutputLines::run() {
    std::uint64_t frames = camera_.moments().frames;
    while (!stopping_.load(std::memory_order_relaxed)) {
        heartbeat_.beat();
        const std::uint32_t seen = camera_.moments_changed().value();
        const CameraMoments moments = camera_.moments();
        if (moments.frames != frames) {
            frames = moments.frames;
            recent_[frames % recent_.size()] = {moments.exposure_start, moments.exposure_end, false};
        }
        const Time now = clock_.now();
        Time next = now + Heartbeat::max_wait_ns;
        if (moments.ready && moments.not_before > now) next = std::min(next, moments.not_before);
        show(ready_, moments.ready && now >= moments.not_before);
        for (Exposure& e : recent_)
            // Signal an exposure that ended before this thread ran too, so that none is left out.
            if (!e.shown && now >= e.start) {
                show(exposure_, true);
                e.shown = true;
            }
        show(exposure_, exposing(now, next));
        for (Line* line : {&ready_, &exposure_})
            if (line->wanted && !line->line) reopen(*line, now);
        camera_.moments_changed().wait(seen, next);
    }
}

bool OutputLines::exposing(Time now, Time& next) const noexcept {
    bool active = false;
    for (const Exposure& e : recent_) {
        active = active || (now >= e.start && now < e.end);
        for (const Time t : {e.start, e.end})
            if (t > now) next = std::min(next, t);
    }
    return active;
}

void OutputLines::show(Line& line, bool active) {
    if (!line.line || line.active == active) return;
    line.active = active;
    if (&line == &exposure_ && active) exposures_.fetch_add(1, std::memory_order_relaxed);
    if (line.line->set(active)) return;
    lost_.fetch_add(1, std::memory_order_relaxed);
    line.line.reset();
    log_warning("{}: the line has gone; waiting for it to come back", line.name);
}

void OutputLines::reopen(Line& line, Time now) {
    if (now < next_try_) return;
    next_try_ = now + reopen_every_ns;
    try {
        line.line = line.open();
        line.active = false;
        log_notice("{}: the line is back", line.name);
    } catch (const Error&) {
        // The loss of the line has been logged already.
    }
}

} // namespace obscura::emulator
