// SPDX-License-Identifier: Apache-2.0
#include "emulator/trigger/trigger_router.hpp"

#include <optional>

namespace obscura::emulator {
namespace {

constexpr TriggerRoute software_route = route_of(TriggerSource::software);

} // namespace

TriggerRouter::TriggerRouter(const Config& config, const CameraSettings& initial, const Clock& clock,
                             sync::MissedListener& missed, const AlarmPort::Make& make_alarms)
    : config_(config),
      clock_(clock),
      missed_(missed),
      alarms_(make_alarms([this](std::size_t alarm, Time due) { on_alarm(alarm, due); })),
      gate_(config.over_trigger),
      events_(*this, clock, *alarms_, first_event_alarm) {
    for (std::size_t i = 0; i < line_count; ++i) {
        line_sinks_[i].router = this;
        line_sinks_[i].number = i;
    }
    gate_.set_missed_listener(this);
    gate_.select(route_of(initial));
    set(initial);
}

TriggerRouter::~TriggerRouter() {
    alarms_->stop(); // before the members that its thread uses
}

void TriggerRouter::set(const CameraSettings& settings) {
    divider_.store(settings.trigger_divider, std::memory_order_relaxed);
    // TriggerOverlap PreviousFrame overrides the configured policy; the latter cannot latch by itself.
    const sync::OverTrigger without_latch = config_.over_trigger == sync::OverTrigger::ignore
                                                ? sync::OverTrigger::ignore
                                                : sync::OverTrigger::count;
    gate_.set_policy(settings.trigger_overlap == TriggerOverlap::previous_frame ? sync::OverTrigger::latch
                                                                                : without_latch);
    frame_trigger_.set(settings.frame_trigger);
    start_trigger_.set(settings.start_trigger);
    burst_.set(settings.burst_trigger, settings.burst_frame_count);
    exposure_trigger_.set(settings.exposure_trigger);
    trigger_width_.store(settings.exposure_mode == ExposureMode::trigger_width, std::memory_order_relaxed);
    events_.set(settings);
}

void TriggerRouter::select(const CameraSettings& settings) noexcept {
    const TriggerRoute before = gate_.selected(), now = route_of(settings);
    gate_.select(now);
    if (before != now) forget();
}

void TriggerRouter::forget() noexcept {
    burst_.reset();
    exposure_armed_.store(0, std::memory_order_relaxed);
    alarms_->clear(burst_frame);
    alarms_->clear(level_frame);
    selection_.fetch_add(1, std::memory_order_relaxed);
}

void TriggerRouter::acquisition_start(const CameraSettings& settings, Time begin) noexcept {
    numbers_.reset();
    forget();
    start_awaited_.store(settings.start_trigger.enabled && !level_holds(start_trigger_),
                         std::memory_order_release);
    acquisition_start_ns_.store(begin.ns, std::memory_order_relaxed);
    acquisitions_.fetch_add(1, std::memory_order_release);
    events_.acquisition_start();
    gate_.open();
    moments_changed_.notify();
    events_.request_scan();
}

void TriggerRouter::acquisition_stop(bool and_finished) noexcept {
    gate_.close(and_finished);
    start_awaited_.store(false, std::memory_order_release);
}

bool TriggerRouter::software_frame_start(Time edge, std::uint64_t request) noexcept {
    sync::Trigger trigger{software_ids_.fetch_add(1) + 1, edge, clock_.now()};
    trigger.request = request;
    if (acquisition_start_awaited() || burst_.awaited()) return false;
    return frame_trigger_.accepts(TriggerSource::software, false) ? start_frame(trigger, software_route)
                                                                  : offer(trigger, software_route);
}

bool TriggerRouter::software_acquisition_start() noexcept {
    return start_acquisition(TriggerSource::software, false);
}

bool TriggerRouter::software_burst_start(Time edge) noexcept {
    return burst_.accepts(TriggerSource::software, false) && start_burst({0, edge, clock_.now()});
}

bool TriggerRouter::software_exposure_start(Time edge) noexcept {
    if (acquisition_start_awaited() || burst_.awaited() ||
        !exposure_trigger_.accepts(TriggerSource::software, false))
        return false;
    return start_exposure({exposure_ids_.fetch_add(1) + 1, edge, clock_.now()}, software_route);
}

bool TriggerRouter::action(Time edge) noexcept {
    return route_edge({action_ids_.fetch_add(1) + 1, edge, clock_.now()}, TriggerSource::action1);
}

void TriggerRouter::FreeRunSink::on_trigger(const sync::Trigger& trigger) noexcept {
    if (!router.acquisition_start_awaited()) router.gate_.offer(trigger, free_run_route);
}

void TriggerRouter::line_edge(std::size_t number, const sync::Trigger& trigger) noexcept {
    InputLine& line = lines_[number];
    const std::uint64_t lost = line.record(trigger);
    events_.request_scan();
    // For dual-edge inputs renumber the active edges.
    const TriggerActivation activation = exposing_trigger().activation();
    const bool active = activates(activation, trigger.falling);
    sync::Trigger numbered = trigger;
    if (active && activation != TriggerActivation::any_edge && config_.lines[number].both())
        numbered.id = line.number_active(lost);
    const std::optional<sync::Trigger> pulse =
        line.end_pulse(trigger, selection_.load(std::memory_order_relaxed));
    const TriggerSource source = source_of_line(number);
    if (active || !pulse || !measures_pulse(source))
        route_edge(numbered, source);
    else if (exposure_trigger_.enabled())
        start_exposure(*pulse, route_of(source));
    else
        divide(*pulse, route_of(source));
}

bool TriggerRouter::route_edge(const sync::Trigger& trigger, TriggerSource source) noexcept {
    const TriggerRoute route = route_of(source);
    // AcquisitionStart.
    if (start_acquisition(source, trigger.falling)) return true;
    if (acquisition_start_awaited()) return false;
    // FrameBurstStart.
    const bool for_burst = burst_.accepts(source, trigger.falling);
    if (burst_.awaited()) {
        if (!for_burst || !start_burst(trigger)) return false;
        numbers_.consume(route);
        return true;
    }
    // FrameStart, unless it has armed the exposure already.
    const bool for_exposure = exposure_trigger_.accepts(source, trigger.falling);
    const bool armed = exposure_armed_.load(std::memory_order_acquire) != 0;
    if (frame_trigger_.accepts(source, trigger.falling) && !(for_exposure && armed)) {
        if (level_holds(frame_trigger_)) {
            continue_level(trigger.edge);
            return true;
        }
        return begin_pulse(trigger, frame_trigger_, source) || start_frame(trigger, route);
    }
    // ExposureStart.
    if (for_exposure)
        return begin_pulse(trigger, exposure_trigger_, source) || start_exposure(trigger, route);
    if (for_burst)
        gate_.miss(trigger);
    else if (gate_.selected() != route)
        gate_.offer(trigger, route); // counts it as ignored
    return false;
}

bool TriggerRouter::start_acquisition(TriggerSource source, bool falling) noexcept {
    if (!acquisition_start_awaited() || !start_trigger_.accepts(source, falling)) return false;
    if (!start_awaited_.exchange(false, std::memory_order_acq_rel)) return false;
    moments_changed_.notify();
    continue_level(clock_.now());
    return true;
}

bool TriggerRouter::start_burst(const sync::Trigger& trigger) noexcept {
    if (!gate_.is_open() || acquisition_start_awaited()) return false;
    if (!burst_.begin()) {
        gate_.miss(trigger); // a burst is in progress
        return false;
    }
    if (gate_.selected() == free_run_route) alarms_->set(burst_frame, trigger.edge);
    continue_level(trigger.edge);
    moments_changed_.notify();
    return true;
}

bool TriggerRouter::start_frame(const sync::Trigger& trigger, TriggerRoute route) noexcept {
    if (!exposure_trigger_.enabled()) return divide(trigger, route);
    if (!gate_.is_open()) return false;
    numbers_.consume(route);
    std::uint64_t unarmed = 0;
    if (exposure_armed_.compare_exchange_strong(
            unarmed, trigger.request != 0 ? trigger.request : armed_without_request,
            std::memory_order_acq_rel))
        return true;
    gate_.miss(trigger);
    return false;
}

bool TriggerRouter::start_exposure(const sync::Trigger& trigger, TriggerRoute route) noexcept {
    const std::uint64_t armed = exposure_armed_.load(std::memory_order_acquire);
    if (frame_trigger_.enabled() && armed == 0) return false;
    sync::Trigger exposing = trigger;
    // The frame is that of the edge of FrameStart too.
    if (exposing.request == 0 && armed != armed_without_request) exposing.request = armed;
    const bool taken = offer(exposing, route);
    if (taken) exposure_armed_.store(0, std::memory_order_release);
    return taken;
}

/// SFNC TriggerDivider. An edge that it skips is consumed.
bool TriggerRouter::divide(const sync::Trigger& trigger, TriggerRoute route) noexcept {
    const std::uint32_t divider = divider_.load(std::memory_order_relaxed);
    if (divider <= 1 || !gate_.is_open()) return offer(trigger, route);
    const std::optional<sync::Trigger> divided = numbers_.divided(trigger, route, divider);
    if (divided) return offer(*divided, route);
    if (trigger.request != 0) missed_.on_refused(trigger);
    return true;
}

bool TriggerRouter::offer(const sync::Trigger& trigger, TriggerRoute route) noexcept {
    return count_in_burst(gate_.offer(numbers_.without_consumed(trigger, route), route));
}

bool TriggerRouter::count_in_burst(bool taken) noexcept {
    if (taken) burst_.count_frame();
    return taken;
}

/// Level-triggered frames, and bursts without FrameStart, are paced by the alarms. A frame that the camera is
/// not ready for is missed, and a burst goes on until it is complete.
void TriggerRouter::on_alarm(std::size_t alarm, Time due) noexcept {
    if (alarm >= first_event_alarm) {
        events_.on_alarm(alarm, due);
        return;
    }
    if (!gate_.is_open() || acquisition_start_awaited() || burst_.awaited()) return;
    const bool wanted =
        alarm == level_frame ? level_holds(frame_trigger_) : gate_.selected() == free_run_route;
    if (!wanted) return;
    const sync::Trigger trigger{self_paced_ids_.fetch_add(1) + 1, due, clock_.now()};
    if (alarm == level_frame)
        start_frame(trigger, route_of(frame_trigger_.source()));
    else
        count_in_burst(gate_.offer(trigger, free_run_route));
    if (!burst_.awaited()) alarms_->set(alarm, due + frame_period_ns_.load(std::memory_order_relaxed));
}

bool TriggerRouter::level_holds(const SharedTriggerChoice& shared) const noexcept {
    const TriggerChoice trigger = shared.get();
    const std::size_t line = line_of(trigger.source);
    return trigger.enabled && is_level(trigger.activation) && line < line_count &&
           lines_[line].high() == (trigger.activation == TriggerActivation::level_high);
}

void TriggerRouter::continue_level(Time due) noexcept {
    if (level_holds(frame_trigger_)) alarms_->set(level_frame, due);
}

/// ExposureMode TriggerWidth applies to the exposing trigger, on one edge type of a dual-edge input.
bool TriggerRouter::measures_pulse(TriggerSource source) const noexcept {
    const std::size_t line = line_of(source);
    if (!trigger_width_.load(std::memory_order_relaxed) || line == line_count || !config_.lines[line].both())
        return false;
    const TriggerChoice trigger = exposing_trigger().get();
    return trigger.enabled && trigger.source == source && !is_level(trigger.activation) &&
           trigger.activation != TriggerActivation::any_edge;
}

/// ExposureMode TriggerWidth: an edge that begins a pulse is offered to the gate at the end of the pulse.
bool TriggerRouter::begin_pulse(const sync::Trigger& trigger, const SharedTriggerChoice& by,
                                TriggerSource source) noexcept {
    if (&by != &exposing_trigger() || !measures_pulse(source) || !gate_.is_open()) return false;
    lines_[line_of(source)].begin_pulse(trigger, selection_.load(std::memory_order_relaxed));
    return true;
}

void TriggerRouter::on_missed(Time edge) noexcept {
    missed_.on_missed(edge);
    events_.request_scan();
}

IoInputs TriggerRouter::io_inputs() const noexcept {
    IoInputs in;
    in.activity = activity(); // before the time, so that its events are not after `now`
    in.now = clock_.now();
    return in;
}

void TriggerRouter::on_end(TriggerSource source, const sync::Trigger& end) noexcept {
    route_edge(end, source);
}

void TriggerRouter::frame_begun(const FrameInstants& instants) noexcept {
    frame_moments_.publish(instants);
    moments_changed_.notify();
    events_.frame_begun(instants);
}

bool TriggerRouter::ready() const noexcept {
    return gate_.ready() && !start_awaited_.load(std::memory_order_relaxed) && !burst_.awaited();
}

bool TriggerRouter::ready_for_line(std::size_t line, Time edge) const noexcept {
    return !start_awaited_.load(std::memory_order_relaxed) && !burst_.awaited() &&
           gate_.selected() == route_of(source_of_line(line)) && gate_.ready_for(edge);
}

std::optional<Time> TriggerRouter::next_line_edge(Time t) const noexcept {
    const TriggerChoice trigger = frame_trigger_.get();
    const std::size_t line = line_of(trigger.source);
    const bool alone = !start_trigger_.enabled() && !burst_.enabled() && !exposure_trigger_.enabled();
    if (!alone || !trigger.enabled || line == line_count || is_level(trigger.activation) ||
        (trigger.activation == TriggerActivation::any_edge && config_.lines[line].both()) ||
        divider_.load(std::memory_order_relaxed) > 1 || trigger_width_.load(std::memory_order_relaxed))
        return std::nullopt;
    return lines_[line].forecast().next(trigger.activation == TriggerActivation::falling_edge, t);
}

CameraActivity TriggerRouter::activity() const noexcept {
    const sync::GateCounters gate = gate_.counters();
    CameraActivity a;
    for (std::size_t i = 0; i < line_count; ++i)
        a.lines[i] = lines_[i].activity();
    a.acquisitions = acquisitions_.load(std::memory_order_acquire);
    a.acquisition_start = Time{acquisition_start_ns_.load(std::memory_order_relaxed)};
    events_.fill(a);
    a.frame_triggers = gate.taken;
    a.missed_triggers = gate.missed;
    frame_moments_.fill(a);
    a.trigger_ready = ready();
    a.start_awaited = start_awaited_.load(std::memory_order_relaxed);
    return a;
}

CameraMoments TriggerRouter::moments() const noexcept {
    CameraMoments m;
    frame_moments_.fill(m);
    m.ready = ready();
    m.not_before = gate_.not_before();
    return m;
}

} // namespace obscura::emulator
