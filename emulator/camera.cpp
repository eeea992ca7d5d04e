#include "emulator/camera.hpp"

#include "core/realtime.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace obscura::emulator {
namespace {

constexpr auto software_route = static_cast<std::size_t>(TriggerSource::software);

} // namespace

Time nominal_scene_time(const CameraSettings& settings, sync::RationalRate trigger_rate,
                        std::uint64_t frame_id) {
    const sync::RationalRate rate =
        settings.frame_trigger.enabled ? trigger_rate : sync::rational_rate(settings.frame_rate_hz);
    return sync::Schedule(rate, Time{}, 0).slot(frame_id - 1);
}

Camera::Camera(const CameraConfig& config, FrameMaker& maker, Releaser& releaser, FramePool& pool,
               const Clock& clock, LogRing& log)
    : config_(config),
      maker_(maker),
      releaser_(releaser),
      pool_(pool),
      clock_(clock),
      log_(log),
      settings_(config.initial),
      next_trigger_rate_(config.trigger_rate),
      gate_(config.over_trigger),
      auto_exposure_(config.initial.exposure_ns),
      frame_settings_(config.initial) {
    for (std::size_t i = 0; i < line_count; ++i) {
        lines_[i].camera = this;
        lines_[i].number = i;
    }
    gate_.set_missed_listener(this);
    gate_.select(route_of(config.initial));
    publish_triggers(config.initial);
    ends_.set(config.initial, io_inputs(*this, clock_));
    thread_ = std::thread([this] {
        enter_thread("pipeline", config_.thread);
        declare_this_thread_realtime();
        run();
    });
}

Camera::~Camera() {
    acquisition_stop(true);
    gate_.quit();
    thread_.join();
}

Camera::Route Camera::route_of(const CameraSettings& s) noexcept {
    if (s.exposure_trigger.enabled) return route_of(s.exposure_trigger.source);
    return s.frame_trigger.enabled ? route_of(s.frame_trigger.source) : free_run;
}

CameraSettings Camera::settings() const {
    const std::lock_guard lock(settings_mutex_);
    return auto_exposure_.shown(settings_);
}

std::string Camera::explain(const CameraSettings& settings) const {
    std::string complaint = explain_invalid(settings, config_.limits);
    return complaint.empty() ? maker_.answer(settings).refusal : complaint;
}

bool Camera::apply(const CameraSettings& settings) {
    if (!explain(settings).empty()) return false;
    const std::lock_guard control(control_mutex_);
    if (!explain_invalid(sequence_, settings, config_.limits).empty()) return false;
    const CameraSettings before = this->settings();
    {
        const std::lock_guard lock(settings_mutex_);
        if (settings.exposure_auto != ExposureAuto::off &&
            auto_exposure_.shown(settings_).exposure_auto != settings.exposure_auto)
            auto_exposure_.restart(settings.exposure_ns);
        settings_ = settings;
    }
    publish_triggers(settings);
    ends_.set(settings, io_inputs(*this, clock_));
    for (std::size_t i = 0; i < timer_count; ++i)
        if (before.timers[i] != settings.timers[i]) alarm_.clear(first_timer_end + i);
    look_soon();
    // Without a rate of its own the free run follows the chip, which depends on windows and exposure.
    const bool paced_differently =
        route_of(before) != route_of(settings) || before.frame_rate_hz != settings.frame_rate_hz ||
        before.frame_rate_enabled != settings.frame_rate_enabled ||
        (!settings.frame_rate_enabled &&
         (before.region != settings.region || before.exposure_ns != settings.exposure_ns));
    if (paced_differently) {
        stop_free_run();
        gate_.select(route_of(settings));
        if (route_of(before) != route_of(settings)) forget_triggers();
        if (acquiring()) start_free_run();
    }
    if (acquiring() && before.frame_trigger != settings.frame_trigger) go_on_with_level(clock_.now());
    return true;
}

void Camera::publish_triggers(const CameraSettings& settings) noexcept {
    divider_.store(settings.trigger_divider, std::memory_order_relaxed);
    // An edge that comes too soon is what the configuration says, unless it is to be remembered.
    const sync::OverTrigger forgotten = config_.over_trigger == sync::OverTrigger::ignore
                                            ? sync::OverTrigger::ignore
                                            : sync::OverTrigger::count;
    gate_.set_policy(settings.trigger_overlap == TriggerOverlap::previous_frame ? sync::OverTrigger::latch
                                                                                : forgotten);
    frame_trigger_.set(settings.frame_trigger);
    start_trigger_.set(settings.start_trigger);
    burst_trigger_.set(settings.burst_trigger);
    burst_frames_.store(settings.burst_frame_count, std::memory_order_relaxed);
    exposure_trigger_.set(settings.exposure_trigger);
    trigger_width_.store(settings.exposure_mode == ExposureMode::trigger_width, std::memory_order_relaxed);
}

void Camera::LiveTrigger::set(const TriggerChoice& choice) noexcept {
    source.store(choice.source, std::memory_order_relaxed);
    activation.store(choice.activation, std::memory_order_relaxed);
    enabled.store(choice.enabled, std::memory_order_release);
}

TriggerChoice Camera::LiveTrigger::get() const noexcept {
    return {enabled.load(std::memory_order_acquire), source.load(std::memory_order_relaxed),
            activation.load(std::memory_order_relaxed)};
}

void Camera::forget_triggers() noexcept {
    burst_left_.store(0, std::memory_order_relaxed);
    exposure_readied_.store(false, std::memory_order_relaxed);
    alarm_.clear(next_of_burst);
    alarm_.clear(next_of_level);
    acquisition_.fetch_add(1, std::memory_order_relaxed);
}

void Camera::set_trigger_rate(sync::RationalRate rate) {
    const std::lock_guard control(control_mutex_);
    next_trigger_rate_ = rate;
}

bool Camera::acquisition_start() {
    const std::lock_guard control(control_mutex_);
    if (acquiring()) return false;
    stop_free_run();    // of an acquisition that ended by itself
    gate_.close(false); // until the last trigger has its frame id
    const CameraSettings now = settings();
    next_frame_id_ = 1;
    frames_left_ = now.acquisition_mode == AcquisitionMode::single_frame  ? 1
                   : now.acquisition_mode == AcquisitionMode::multi_frame ? now.acquisition_frame_count
                                                                          : UINT64_MAX;
    const Time begin = clock_.now();
    trigger_rate_ = next_trigger_rate_;
    frame_sequence_ = sequence_;
    sequence_step_ = sequence_.start;
    for (auto& first : first_id_)
        first.store(0, std::memory_order_relaxed);
    for (auto& used_up : used_up_)
        used_up.store(0, std::memory_order_relaxed);
    forget_triggers();
    start_awaited_.store(now.start_trigger.enabled && !level_holds(start_trigger_),
                         std::memory_order_release);
    acquisition_start_ns_.store(begin.ns, std::memory_order_relaxed);
    acquisitions_.fetch_add(1, std::memory_order_release);
    ends_.acquisition_start(io_inputs(*this, clock_));
    gate_.open();
    moments_changed_.notify();
    start_free_run();
    go_on_with_level(begin);
    look_soon();
    return true;
}

void Camera::acquisition_stop(bool abort) {
    const std::lock_guard control(control_mutex_);
    stop_free_run();
    if (abort) {
        cancel_ = true;
        releaser_.abandon_all();
    }
    // A trigger that was taken just now still becomes a frame; close() waits until it is with the transports
    // and, after an abort, until the pipeline has noticed.
    gate_.close(abort);
    start_awaited_.store(false, std::memory_order_release);
    if (abort) {
        releaser_.abandon_all(); // a frame that was ready and waited for its time
        releaser_.wait_idle();
        cancel_ = false;
    }
}

bool Camera::acquiring() const {
    return gate_.is_open();
}

bool Camera::trigger_ready() const noexcept {
    return gate_.ready() && !start_awaited_.load(std::memory_order_relaxed) && !burst_awaited();
}

bool Camera::ready_for_line0(Time edge) const noexcept {
    return !start_awaited_.load(std::memory_order_relaxed) && !burst_awaited() &&
           gate_.selected() == route_of(TriggerSource::line0) && gate_.ready_for(edge);
}

CameraMoments Camera::moments() const noexcept {
    const auto instant = [](const std::atomic<std::int64_t>& ns) {
        return Time{ns.load(std::memory_order_relaxed)};
    };
    CameraMoments m;
    m.frames = moments_.frames.load(std::memory_order_acquire);
    m.frame_id = moments_.frame_id.load(std::memory_order_relaxed);
    m.exposure_start = instant(moments_.exposure_start_ns);
    m.exposure_end = instant(moments_.exposure_end_ns);
    m.ready = trigger_ready();
    m.not_before = gate_.not_before();
    return m;
}

double Camera::free_run_rate_hz() const {
    const CameraSettings s = settings();
    if (s.frame_rate_enabled) return s.frame_rate_hz;
    // A part in a million slower than the chip can: an edge that comes a nanosecond too soon would be missed.
    const double fastest_hz = 1e9 / (static_cast<double>(readout(s).frame_period_ns) * 1.000001 + 1);
    return std::clamp(fastest_hz, config_.limits.frame_rate_min_hz, config_.limits.frame_rate_max_hz);
}

void Camera::start_free_run() {
    const CameraSettings now = settings();
    frame_period_ns_.store(std::llround(1e9 / free_run_rate_hz()), std::memory_order_relaxed);
    // A burst trigger begins the frames itself, and the alarm goes on with them.
    if (route_of(now) != free_run || now.burst_trigger.enabled) return;
    sync::TimerSettings timer;
    timer.rate = sync::rational_rate(free_run_rate_hz());
    timer.thread = config_.trigger_thread;
    free_run_ = std::make_unique<sync::TimerTrigger>(timer, std::make_unique<MonotonicClock>());
    free_run_->start(free_run_sink_);
}

void Camera::stop_free_run() {
    free_run_.reset();
}

bool Camera::take_start(TriggerSource source, bool falling) noexcept {
    if (!start_awaited_.load(std::memory_order_acquire) || !start_trigger_.wants(source, falling))
        return false;
    if (!start_awaited_.exchange(false, std::memory_order_acq_rel)) return false;
    moments_changed_.notify();
    go_on_with_level(clock_.now());
    return true;
}

bool Camera::burst_awaited() const noexcept {
    return burst_trigger_.enabled.load(std::memory_order_acquire) &&
           burst_left_.load(std::memory_order_acquire) == 0;
}

bool Camera::take_burst(const sync::Trigger& trigger) noexcept {
    if (!gate_.is_open() || start_awaited_.load(std::memory_order_acquire)) return false;
    std::uint32_t none = 0;
    if (!burst_left_.compare_exchange_strong(none, burst_frames_.load(std::memory_order_relaxed),
                                             std::memory_order_acq_rel)) {
        gate_.miss(trigger); // in the middle of a burst
        return false;
    }
    if (gate_.selected() == free_run) alarm_.set(next_of_burst, trigger.edge);
    go_on_with_level(trigger.edge);
    moments_changed_.notify();
    return true;
}

bool Camera::taken_of_burst(bool taken) noexcept {
    if (taken && burst_trigger_.enabled.load(std::memory_order_relaxed))
        burst_left_.fetch_sub(1, std::memory_order_acq_rel);
    return taken;
}

void Camera::ring(std::size_t alarm, Time due) noexcept {
    if (alarm >= first_timer_end) {
        const std::size_t timer = alarm - first_timer_end;
        if (ends_.timer_runs(timer, io_inputs(*this, clock_))) fire_end(counter_count + timer, due);
        return;
    }
    if (alarm != next_of_burst && alarm != next_of_level) {
        look_at_ends();
        return;
    }
    if (!gate_.is_open() || start_awaited_.load(std::memory_order_acquire) || burst_awaited()) return;
    // A frame that the camera was not ready for is missed, and the burst goes on until it is complete.
    const sync::Trigger trigger{self_ids_.fetch_add(1) + 1, due, clock_.now()};
    if (alarm == next_of_level) {
        if (!level_holds(frame_trigger_)) return;
        take_frame(trigger, route_of(frame_trigger_.source.load(std::memory_order_relaxed)));
    } else {
        if (gate_.selected() != free_run) return;
        taken_of_burst(gate_.offer(trigger, free_run));
    }
    if (!burst_awaited()) alarm_.set(alarm, due + frame_period_ns_.load(std::memory_order_relaxed));
}

bool Camera::level_holds(const LiveTrigger& live) const noexcept {
    const TriggerChoice trigger = live.get();
    const std::size_t line = line_of(trigger.source);
    return trigger.enabled && is_level(trigger.activation) && line < line_count &&
           lines_[line].high.load(std::memory_order_relaxed) ==
               (trigger.activation == TriggerActivation::level_high);
}

void Camera::go_on_with_level(Time due) noexcept {
    if (level_holds(frame_trigger_)) alarm_.set(next_of_level, due);
}

/// On the alarm's thread, so that whoever makes things happen is not held up.
void Camera::look_soon() noexcept {
    if (!ends_.idle()) alarm_.set(look, clock_.now());
}

void Camera::look_at_ends() noexcept {
    ends_.begin_look();
    const IoInputs in = io_inputs(*this, clock_);
    Time t;
    for (std::size_t i = 0; i < counter_count; ++i)
        for (std::uint64_t n = ends_.new_counter_ends(i, in, t); n > 0; --n)
            fire_end(i, t);
    for (std::size_t i = 0; i < timer_count; ++i)
        if (ends_.timer_started(i, in, t)) alarm_.set(first_timer_end + i, t);
}

void Camera::fire_end(std::size_t end, Time t) noexcept {
    const auto source =
        static_cast<TriggerSource>(static_cast<std::size_t>(TriggerSource::counter0_end) + end);
    serve({end_ids_[end].fetch_add(1, std::memory_order_relaxed) + 1, t, clock_.now()}, source);
}

/// An edge is for the first trigger that waits for one: of the acquisition, the burst, the frame, the
/// exposure.
bool Camera::serve(const sync::Trigger& trigger, TriggerSource source) noexcept {
    const Route route = route_of(source);
    if (take_start(source, trigger.falling)) return true;
    if (start_awaited_.load(std::memory_order_acquire)) return false;
    const bool for_burst = burst_trigger_.wants(source, trigger.falling);
    if (burst_awaited()) {
        if (!for_burst || !take_burst(trigger)) return false;
        used_up_[route].fetch_add(1, std::memory_order_relaxed);
        return true;
    }
    const bool for_exposure = exposure_trigger_.wants(source, trigger.falling);
    const bool readied = exposure_readied_.load(std::memory_order_acquire);
    if (frame_trigger_.wants(source, trigger.falling) && !(for_exposure && readied)) {
        if (level_holds(frame_trigger_)) {
            go_on_with_level(trigger.edge);
            return true;
        }
        return await_pulse(trigger, frame_trigger_, source) || take_frame(trigger, route);
    }
    if (for_exposure) return await_pulse(trigger, exposure_trigger_, source) || take_exposure(trigger, route);
    if (for_burst)
        gate_.miss(trigger);
    else if (gate_.selected() != route)
        gate_.offer(trigger, route); // counts it as ignored
    return false;
}

/// ExposureMode TriggerWidth, and an edge that begins a pulse: what is done with it comes at the end of that.
bool Camera::await_pulse(const sync::Trigger& trigger, const LiveTrigger& from,
                         TriggerSource source) noexcept {
    const bool is_exposing = &from == &exposing_trigger();
    if (!is_exposing || !width_counts(source) || !gate_.is_open()) return false;
    Line& line = lines_[line_of(source)];
    line.pulse = trigger;
    line.pulse_of = acquisition_.load(std::memory_order_relaxed);
    return true;
}

/// The one whose edge exposes.
const Camera::LiveTrigger& Camera::exposing_trigger() const noexcept {
    return exposure_trigger_.enabled.load(std::memory_order_acquire) ? exposure_trigger_ : frame_trigger_;
}

bool Camera::width_counts(TriggerSource source) const noexcept {
    const std::size_t line = line_of(source);
    if (!trigger_width_.load(std::memory_order_relaxed) || line == line_count ||
        !config_.limits.lines[line].both())
        return false;
    const TriggerChoice trigger = exposing_trigger().get();
    return trigger.enabled && trigger.source == source && !is_level(trigger.activation) &&
           trigger.activation != TriggerActivation::any_edge;
}

/// Edges that made no frame because they were for something else are not lost ones.
bool Camera::offer_to_gate(sync::Trigger trigger, Route route) noexcept {
    const std::uint64_t used_up = used_up_[route].load(std::memory_order_relaxed);
    if (trigger.id > used_up) trigger.id -= used_up;
    return taken_of_burst(gate_.offer(trigger, route));
}

bool Camera::take_frame(const sync::Trigger& trigger, Route route) noexcept {
    if (!exposure_trigger_.enabled.load(std::memory_order_acquire)) return offer(trigger, route);
    if (!gate_.is_open()) return false;
    used_up_[route].fetch_add(1, std::memory_order_relaxed);
    if (!exposure_readied_.exchange(true, std::memory_order_acq_rel)) return true;
    gate_.miss(trigger);
    return false;
}

bool Camera::take_exposure(const sync::Trigger& trigger, Route route) noexcept {
    const bool by_frame_trigger = frame_trigger_.enabled.load(std::memory_order_acquire);
    if (by_frame_trigger && !exposure_readied_.load(std::memory_order_acquire)) return false;
    const bool taken = offer_to_gate(trigger, route);
    if (taken) exposure_readied_.store(false, std::memory_order_release);
    return taken;
}

bool Camera::offer(const sync::Trigger& trigger, Route route) noexcept {
    const std::uint32_t divider = divider_.load(std::memory_order_relaxed);
    if (divider <= 1 || !gate_.is_open()) return offer_to_gate(trigger, route);
    // The first edge of the acquisition counts, then every so many; ids are renumbered, so that the gate does
    // not take the others for lost. Each route has one thread that calls.
    std::uint64_t first = first_id_[route].load(std::memory_order_relaxed);
    if (first == 0) first_id_[route].store(first = trigger.id, std::memory_order_relaxed);
    sync::Trigger counted = trigger;
    const std::uint64_t n = trigger.id - first;
    counted.id = n / divider + 1;
    return n % divider != 0 || offer_to_gate(counted, route);
}

bool Camera::software_start_trigger(Time) {
    return take_start(TriggerSource::software, false);
}

bool Camera::software_burst_trigger(Time edge) {
    return burst_trigger_.wants(TriggerSource::software, false) && take_burst({0, edge, clock_.now()});
}

bool Camera::software_exposure_trigger(Time edge) {
    if (start_awaited_.load(std::memory_order_acquire) || burst_awaited() ||
        !exposure_trigger_.wants(TriggerSource::software, false))
        return false;
    return take_exposure({exposure_edges_.fetch_add(1) + 1, edge, clock_.now()}, software_route);
}

bool Camera::software_trigger(Time edge) {
    const sync::Trigger trigger{software_edges_.fetch_add(1) + 1, edge, clock_.now()};
    if (start_awaited_.load(std::memory_order_acquire) || burst_awaited()) return false;
    return frame_trigger_.wants(TriggerSource::software, false) ? take_frame(trigger, software_route)
                                                                : offer_to_gate(trigger, software_route);
}

bool Camera::action_trigger(Time edge) {
    const sync::Trigger trigger{action_edges_.fetch_add(1) + 1, edge, clock_.now()};
    return serve(trigger, TriggerSource::action1);
}

void Camera::on_trigger(const sync::Trigger& trigger) noexcept {
    line_edge(0, trigger);
}

void Camera::line_edge(std::size_t number, const sync::Trigger& trigger) noexcept {
    Line& line = lines_[number];
    const TriggerSource source = source_of_line(number);
    line.edge_ns.store(trigger.edge.ns, std::memory_order_relaxed);
    line.high.store(!trigger.falling, std::memory_order_relaxed);
    line.edges.fetch_add(1, std::memory_order_release);
    look_soon();
    const std::uint64_t lost =
        line.last_id != 0 && trigger.id > line.last_id ? trigger.id - line.last_id - 1 : 0;
    line.last_id = trigger.id;
    // Where the source tells of both kinds, ids count those that matter, and half of the lost ones with them.
    const TriggerActivation activation = exposing_trigger().activation.load(std::memory_order_relaxed);
    const bool one_of_two = activation != TriggerActivation::any_edge && config_.limits.lines[number].both();
    const bool begins = activates(activation, trigger.falling);
    sync::Trigger counted = trigger;
    if (one_of_two && begins) {
        line.counted_id += 1 + lost / 2;
        counted.id = line.counted_id;
    }
    const std::uint32_t pulse_of = std::exchange(line.pulse_of, 0);
    if (begins || pulse_of != acquisition_.load(std::memory_order_relaxed) || !width_counts(source)) {
        serve(counted, source);
        return;
    }
    sync::Trigger pulse = line.pulse;
    pulse.seen = trigger.seen;
    pulse.width_ns = trigger.edge - pulse.edge;
    if (exposure_trigger_.enabled.load(std::memory_order_acquire))
        take_exposure(pulse, route_of(source));
    else
        offer(pulse, route_of(source));
}

void Camera::reset_counter(std::size_t i) {
    const std::lock_guard control(control_mutex_);
    ends_.reset_counter(i, io_inputs(*this, clock_));
    look_soon();
}

void Camera::reset_timer(std::size_t i) {
    const std::lock_guard control(control_mutex_);
    ends_.reset_timer(i, clock_.now());
    alarm_.clear(first_timer_end + i);
}

ReadoutAnswer Camera::readout(const CameraSettings& settings) const {
    return maker_.answer(settings);
}

bool Camera::set_sequence(const Sequence& sequence) {
    const std::lock_guard control(control_mutex_);
    if (acquiring() || !explain_invalid(sequence, settings(), config_.limits).empty()) return false;
    sequence_ = sequence;
    return true;
}

CameraActivity Camera::activity() const noexcept {
    const sync::GateCounters gate = gate_.counters();
    const auto instant = [](const std::atomic<std::int64_t>& ns) {
        return Time{ns.load(std::memory_order_relaxed)};
    };
    CameraActivity a;
    for (std::size_t i = 0; i < line_count; ++i)
        a.lines[i] = {lines_[i].edges.load(std::memory_order_acquire), instant(lines_[i].edge_ns),
                      lines_[i].high.load(std::memory_order_relaxed)};
    a.acquisitions = acquisitions_.load(std::memory_order_acquire);
    a.acquisition_start = instant(acquisition_start_ns_);
    ends_.fill(a);
    a.frame_triggers = gate.taken;
    a.missed_triggers = gate.missed;
    a.frames = moments_.frames.load(std::memory_order_acquire);
    a.frame_start = instant(moments_.frame_start_ns);
    a.frame_end = instant(moments_.frame_end_ns);
    a.exposure_start = instant(moments_.exposure_start_ns);
    a.exposure_end = instant(moments_.exposure_end_ns);
    a.trigger_ready = trigger_ready();
    a.start_awaited = start_awaited_.load(std::memory_order_relaxed);
    a.sequence_step = moments_.sequence_step.load(std::memory_order_relaxed);
    return a;
}

void Camera::note_moments(const FrameOrder& order) noexcept {
    const sensors::ReadoutPlan& plan = maker_.plan();
    const std::int64_t shift_ns = maker_.scene_to_clock_ns();
    Time first = plan.rows.front().reset, last = plan.rows.front().read;
    for (const RowTime& row : plan.rows) {
        first = std::min(first, row.reset);
        last = std::max(last, row.read);
    }
    const auto note = [](std::atomic<std::int64_t>& to, Time t) {
        to.store(t.ns, std::memory_order_relaxed);
    };
    note(moments_.frame_start_ns, order.trigger_edge);
    note(moments_.frame_end_ns, plan.release.back() + shift_ns);
    note(moments_.exposure_start_ns, first + shift_ns);
    note(moments_.exposure_end_ns, last + shift_ns);
    moments_.frame_id.store(order.frame_id, std::memory_order_relaxed);
    moments_.frames.fetch_add(1, std::memory_order_release);
    moments_changed_.notify();
    if (ends_.idle()) return;
    look_soon();
    alarm_.set(look_exposure_start, first + shift_ns);
    alarm_.set(look_exposure_end, last + shift_ns);
    alarm_.set(look_frame_end, plan.release.back() + shift_ns);
}

void Camera::FreeRunSink::on_trigger(const sync::Trigger& trigger) noexcept {
    if (!camera.start_awaited_.load(std::memory_order_acquire)) camera.gate_.offer(trigger, free_run);
}

void Camera::on_missed(Time edge) noexcept {
    notify(transports::CameraEvent::trigger_missed, edge);
    look_soon();
}

void Camera::notify(transports::CameraEvent event, Time t) noexcept {
    const std::int64_t tai_offset_ns = clock_.tai_offset_ns();
    for (transports::Transport* transport : transports_)
        transport->notify(event, t, tai_offset_ns);
}

bool Camera::alive() noexcept {
    const bool busy = gate_.busy();
    const std::uint64_t progress = frames_.load(std::memory_order_relaxed) + maker_.progress();
    const bool moved = progress != std::exchange(last_progress_, progress);
    return !busy || moved;
}

void Camera::run() noexcept {
    while (gate_.wait())
        make_frame();
}

/// A chip that cannot expose while it reads out says so in its frame period.
bool Camera::waits_for_readout(const CameraSettings& s) const noexcept {
    return config_.limits.overlapped && s.trigger_overlap == TriggerOverlap::off && route_of(s) != free_run;
}

void Camera::make_frame() noexcept {
    FrameRef frame;
    if (start_frame(frame)) {
        Time next = gate_.current().edge + gate_.held_ns() + maker_.busy_ns();
        if (waits_for_readout(frame_settings_))
            next = std::max(next, maker_.plan().release.back() + maker_.scene_to_clock_ns());
        gate_.started(next);
        const bool whole = maker_.fill(*frame, sink_, &releaser_.cancel_flag());
        if (whole && adjusts_exposure_)
            auto_exposure_.adjust(
                exposure_reading(*frame, maker_.histogram(), frame_settings_, config_.limits),
                frame_settings_.exposure_auto);
        releaser_.end(whole);
    } else {
        dropped_.fetch_add(1, std::memory_order_relaxed);
        notify(transports::CameraEvent::error, gate_.current().edge);
    }
    gate_.finished();
    moments_changed_.notify();
}

/// The settings of the frame about to be made, and the exposure that ExposureAuto has reached.
void Camera::take_settings() noexcept {
    // While the control side holds the lock it is about to change settings that are not meant for this frame.
    if (settings_mutex_.try_lock()) {
        frame_settings_ = settings_;
        auto_exposure_.sample();
        settings_mutex_.unlock();
    } else {
        auto_exposure_.sample_same_run();
    }
    const ExposureAuto mode = frame_settings_.exposure_auto;
    if (mode != ExposureAuto::off) frame_settings_.exposure_ns = auto_exposure_.frame_exposure_ns();
    const bool sequenced = frame_sequence_.enabled && (frame_sequence_.features & sequenced_exposure) != 0;
    adjusts_exposure_ = auto_exposure_.adjusts(mode) && !sequenced;
}

bool Camera::start_frame(FrameRef& frame) noexcept {
    take_settings();
    const sync::Trigger& trigger = gate_.current();
    FrameOrder order;
    order.frame_id = next_frame_id_++;
    order.trigger_id = trigger.id;
    order.trigger_edge = trigger.edge;
    order.seen = trigger.seen;
    order.tai_offset_ns = clock_.tai_offset_ns();
    order.clock_state = trigger.clock;
    const std::uint32_t step = sequence_step_;
    order.settings =
        frame_sequence_.enabled ? with_step(frame_settings_, frame_sequence_, step) : frame_settings_;
    if (trigger.width_ns > 0)
        order.settings.exposure_ns =
            std::clamp(trigger.width_ns, config_.limits.exposure_min_ns, config_.limits.exposure_max_ns);
    if (frame_sequence_.enabled) sequence_step_ = frame_sequence_.steps[step].next;
    moments_.sequence_step.store(step, std::memory_order_relaxed);
    // A latched trigger takes effect when the chip is free again.
    order.settings.trigger_delay_ns += gate_.held_ns();
    order.scene_time = trigger.scene != sync::Trigger::scene_of_camera ? trigger.scene
                       : config_.scene_time == SceneTime::nominal
                           ? nominal_scene_time(frame_settings_, trigger_rate_, order.frame_id)
                           : Time{trigger.edge.ns - acquisition_start_ns_.load(std::memory_order_relaxed)};
    if (--frames_left_ == 0) gate_.close_after_this();

    if (!releaser_.has_room() || !(frame = pool_.acquire())) {
        // Once until it works again, not ten times a second.
        if (!std::exchange(out_of_frames_, true))
            log_.push({clock_.now(),
                       LogLevel::warning,
                       "frame {} dropped: every frame of the pool is in use",
                       {static_cast<std::int64_t>(order.frame_id)}});
        maker_.skip(order);
        return false;
    }
    out_of_frames_ = false;
    if (!maker_.prepare(order, *frame).empty()) {
        log_.push({clock_.now(),
                   LogLevel::error,
                   "frame {} dropped: the chip cannot read these windows",
                   {static_cast<std::int64_t>(order.frame_id)}});
        return false;
    }
    frame->info.sequence_step = frame_sequence_.enabled ? step : 0;
    if (const Route route = route_of(frame_settings_); route != free_run)
        if (const std::size_t line = line_of(static_cast<TriggerSource>(route)); line < line_count)
            frame->info.line_status = line_status_line0 << line;
    note_moments(order);
    frame->info.bytes = releaser_.byte_stamps();
    bool taken = false;
    for (transports::Transport* transport : transports_)
        taken = transport->submit(frame) || taken;
    if (!taken) return false;
    frames_.fetch_add(1, std::memory_order_relaxed);
    sink_ = &releaser_.begin(frame, maker_.plan().release, maker_.scene_to_clock_ns());
    // An abort that came before begin() could not reach this frame.
    if (cancel_.load()) releaser_.abandon_all();
    return true;
}

CameraCounters Camera::counters() const noexcept {
    const ReleaseCounters released = releaser_.counters();
    const sync::GateCounters gate = gate_.counters();
    CameraCounters c;
    c.triggers = gate.edges + gate.lost;
    c.missed_triggers = gate.missed;
    c.masked_triggers = gate.masked;
    c.latched_triggers = gate.latched;
    c.ignored = gate.ignored;
    c.dropped = dropped_.load(std::memory_order_relaxed);
    c.frames = frames_.load(std::memory_order_relaxed);
    c.complete = released.complete;
    c.late = released.late;
    c.late_rows = released.late_rows;
    c.abandoned = released.abandoned;
    c.repeated = released.repeated;
    c.late_dropped = released.dropped;
    c.partial = released.partial;
    return c;
}

} // namespace obscura::emulator
