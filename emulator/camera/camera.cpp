// SPDX-License-Identifier: Apache-2.0
#include "emulator/camera/camera.hpp"

#include "core/error.hpp"
#include "core/realtime/realtime.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace obscura::emulator {
namespace {

/// Longest time from a client's AcquisitionStart to the first edge: clients wait for the answer.
constexpr std::int64_t arming_ns = 150 * ns_per_ms;

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
      settings_copy_(config.initial),
      next_trigger_rate_(config.trigger_rate),
      auto_exposure_(config.initial.exposure_ns),
      router_({config.limits.lines, config.over_trigger}, config.initial, clock, *this,
              [&config](Alarm::Handler handler) {
                  return std::make_unique<Alarm>(config.trigger_thread, std::move(handler));
              }),
      scene_clock_(config.scene),
      frame_settings_(config.initial) {
    thread_ = std::thread([this] {
        enter_thread("pipeline", config_.thread);
        if (config_.thread.priority == 0) schedule_this_thread(config_.render);
        declare_this_thread_realtime();
        run();
    });
}

Camera::~Camera() {
    acquisition_stop(true);
    router_.gate().quit();
    thread_.join();
}

CameraSettings Camera::settings() const {
    const std::lock_guard lock(copy_mutex_);
    return auto_exposure_.shown(settings_copy_);
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
    {
        const std::lock_guard lock(copy_mutex_);
        settings_copy_ = settings;
    }
    router_.set(settings);
    // Without a configured rate the free run follows the chip, which depends on windows and exposure.
    const bool paced_differently =
        route_of(before) != route_of(settings) || before.frame_rate_hz != settings.frame_rate_hz ||
        before.frame_rate_enabled != settings.frame_rate_enabled ||
        (!settings.frame_rate_enabled &&
         (before.region != settings.region || before.exposure_ns != settings.exposure_ns));
    if (paced_differently) {
        stop_free_run();
        router_.select(settings);
        if (acquiring()) start_free_run();
    }
    if (acquiring() && before.frame_trigger != settings.frame_trigger) router_.resume_level();
    return true;
}

void Camera::set_trigger_rate(sync::RationalRate rate) {
    const std::lock_guard control(control_mutex_);
    next_trigger_rate_ = rate;
}

bool Camera::acquisition_start() {
    const std::lock_guard control(control_mutex_);
    if (acquiring()) return false;
    stop_free_run();                 // left from an acquisition that ended by itself
    router_.acquisition_stop(false); // waits until the last trigger has its frame id
    const CameraSettings now = settings();
    next_frame_id_ = 1;
    frames_left_ = now.acquisition_mode == AcquisitionMode::single_frame  ? 1
                   : now.acquisition_mode == AcquisitionMode::multi_frame ? now.acquisition_frame_count
                                                                          : UINT64_MAX;
    const Time begin = clock_.now();
    scene_clock_.begin(begin);
    trigger_rate_ = next_trigger_rate_;
    frame_sequence_ = sequence_;
    sequence_step_ = sequence_.start;
    edges_.restart();
    line_known_ = router_.next_line_edge(begin).has_value();
    // The edges of a free run are the camera's own: it says when the first one comes.
    const bool paces = route_of(now) == free_run_route && !now.burst_trigger.enabled;
    first_edge_ = paces && scene_clock_.follows_edges() && maker_.renders_ahead()
                      ? std::optional(begin + arming_ns)
                      : std::nullopt;
    // The pipeline waits for a trigger, which cannot come yet, unless its last frame is still under way.
    if (!router_.busy() && expect_next(expected_)) {
        maker_.render_ahead(expected_);
        if (config_.max_ahead_ns == 0) wait_for_expected();
    }
    router_.acquisition_start(now, begin);
    start_free_run(first_edge_);
    router_.resume_level();
    return true;
}

/// As a camera that arms: the first edge may come as soon as the acquisition has started, and would find its
/// frame half rendered.
void Camera::wait_for_expected() const {
    for (std::int64_t ms = 0; ms < arming_ns / ns_per_ms && !maker_.expected_is_ready(); ++ms)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

void Camera::acquisition_stop(bool abort) {
    const std::lock_guard control(control_mutex_);
    stop_free_run();
    if (abort) {
        cancel_ = true;
        releaser_.abandon_all();
    }
    // A trigger accepted just now still becomes a frame: wait until the transports have it and, after an
    // abort, until the pipeline has stopped.
    router_.acquisition_stop(abort);
    maker_.forget_expected();
    if (abort) {
        releaser_.abandon_all(); // frames that are ready and wait for their release time
        releaser_.wait_idle();
        cancel_ = false;
    }
}

double Camera::free_run_rate_hz() const {
    const CameraSettings s = settings();
    if (s.frame_rate_enabled) return s.frame_rate_hz;
    // One part in a million slower than the chip's limit: an edge a nanosecond too early would be missed.
    const double fastest_hz = 1e9 / (static_cast<double>(readout(s).frame_period_ns) * 1.000001 + 1);
    return std::clamp(fastest_hz, config_.limits.frame_rate_min_hz, config_.limits.frame_rate_max_hz);
}

void Camera::start_free_run(std::optional<Time> first) {
    const CameraSettings now = settings();
    router_.set_frame_period(std::llround(1e9 / free_run_rate_hz()));
    // With a burst trigger the router paces the frames.
    if (route_of(now) != free_run_route || now.burst_trigger.enabled) return;
    sync::TimerSettings timer;
    timer.rate = sync::rational_rate(free_run_rate_hz());
    timer.thread = config_.trigger_thread;
    timer.start = first;
    free_run_ = std::make_unique<sync::TimerTrigger>(timer, std::make_unique<MonotonicClock>());
    free_run_->start(router_.free_run());
}

void Camera::reset_counter(std::size_t i) {
    const std::lock_guard control(control_mutex_);
    router_.reset_counter(i);
}

void Camera::reset_timer(std::size_t i) {
    const std::lock_guard control(control_mutex_);
    router_.reset_timer(i);
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
    CameraActivity a = router_.activity();
    a.sequence_step = last_sequence_step_.load(std::memory_order_relaxed);
    return a;
}

void Camera::on_missed(Time edge) noexcept {
    notify(transports::CameraEvent::trigger_missed, edge);
}

void Camera::on_refused(const sync::Trigger& trigger) noexcept {
    releaser_.outcomes().publish(
        {.trigger_id = trigger.id, .request = trigger.request, .acquisition = maker_.acquisitions()});
}

void Camera::add_transport(transports::Transport& transport) {
    if (transports_.size() == max_transports)
        throw ConfigError(fmt::format("a camera has at most {} transports", max_transports));
    transport.set_transmit_slot(transports_.size());
    transports_.push_back(&transport);
}

void Camera::add_viewers(transports::Transport& viewers) {
    add_transport(viewers);
    viewers_ = &viewers;
}

void Camera::notify(transports::CameraEvent event, Time t) noexcept {
    const std::int64_t tai_offset_ns = clock_.tai_offset_ns();
    for (transports::Transport* transport : transports_)
        transport->notify(event, t, tai_offset_ns);
}

bool Camera::alive() noexcept {
    const bool busy = router_.busy();
    const std::uint64_t progress = frames_.load(std::memory_order_relaxed) + maker_.progress();
    const bool moved = progress != std::exchange(last_progress_, progress);
    return !busy || moved;
}

void Camera::run() noexcept {
    while (router_.gate().wait())
        make_frame();
}

/// True if TriggerOverlap Off makes a triggered frame wait for the readout before it. A chip that cannot
/// expose during readout has this in its frame period already.
bool Camera::waits_for_readout(const CameraSettings& s) const noexcept {
    return config_.limits.overlapped && s.trigger_overlap == TriggerOverlap::off &&
           route_of(s) != free_run_route;
}

void Camera::make_frame() noexcept {
    sync::TriggerGate& gate = router_.gate();
    FrameRef frame;
    if (start_frame(frame)) {
        Time next = gate.current().edge + gate.held_ns() + maker_.busy_ns();
        if (waits_for_readout(frame_settings_))
            next = std::max(next, maker_.plan().release.back() + maker_.scene_to_clock_ns());
        gate.started(next);
        // The next exposure is known when this frame has been measured.
        const ExpectedFrame* const expected =
            !adjusts_exposure_ && expect_next(expected_) ? &expected_ : nullptr;
        const bool whole = maker_.fill(*frame, sink_, &releaser_.cancel_flag(), releaser_.work(), expected);
        if (whole && adjusts_exposure_) {
            auto_exposure_.adjust(
                exposure_reading(*frame, maker_.histogram(), frame_settings_, config_.limits),
                frame_settings_.exposure_auto);
            if (expect_next(expected_)) maker_.render_ahead(expected_);
        }
        releaser_.end(whole);
    } else {
        dropped_.fetch_add(1, std::memory_order_relaxed);
        notify(transports::CameraEvent::error, gate.current().edge);
        releaser_.outcomes().publish({.frame_id = next_frame_id_ - 1,
                                      .trigger_id = gate.current().id,
                                      .request = gate.current().request,
                                      .acquisition = maker_.acquisitions(),
                                      .outcome = FrameOutcome::dropped});
    }
    gate.finished();
    router_.moments_changed().notify();
}

/// Takes the settings of the next frame, and the exposure that ExposureAuto has reached.
void Camera::take_settings() noexcept {
    // Keep the old settings while apply() holds the lock: the new ones are not meant for this frame.
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

/// What the light of a frame depends on: settings of the current step of the sequencer, and scene time.
void Camera::order_light(const CameraSettings& settings, const SceneClock::Edge& edge,
                         FrameOrder& order) const noexcept {
    order.frame_id = edge.frame_id;
    order.settings =
        frame_sequence_.enabled ? with_step(settings, frame_sequence_, sequence_step_) : settings;
    const SceneClock::Instant instant = scene_clock_.at(edge);
    order.scene_time = instant.planned;
    order.shown = instant.shown;
}

/// Numbers the frame of the current trigger and advances the sequencer.
FrameOrder Camera::next_order() noexcept {
    const sync::Trigger& trigger = router_.gate().current();
    FrameOrder order;
    order.trigger_id = trigger.id;
    order.trigger_edge = trigger.edge;
    order.seen = trigger.seen;
    edges_.add(trigger.edge);
    order.tai_offset_ns = clock_.tai_offset_ns();
    order.clock_state = trigger.clock;
    const std::uint64_t id = next_frame_id_++;
    order_light(frame_settings_,
                {.frame_id = id,
                 .nominal = nominal_scene_time(frame_settings_, trigger_rate_, id),
                 .edge = trigger.edge,
                 .tai_offset_ns = order.tai_offset_ns,
                 .given = trigger.scene == sync::Trigger::scene_of_camera ? std::nullopt
                                                                          : std::optional(trigger.scene)},
                order);
    scene_ns_.store(order.shown.at(order.scene_time).ns, std::memory_order_relaxed);
    if (trigger.width_ns > 0)
        order.settings.exposure_ns =
            std::clamp(trigger.width_ns, config_.limits.exposure_min_ns, config_.limits.exposure_max_ns);
    // Apply a latched trigger when the chip is free again.
    order.settings.trigger_delay_ns += router_.gate().held_ns();
    last_sequence_step_.store(sequence_step_, std::memory_order_relaxed);
    if (frame_sequence_.enabled) sequence_step_ = frame_sequence_.steps[sequence_step_].next;
    return order;
}

/// The edge of the next frame: what its source says, or what the edges so far let expect, those before the
/// acquisition too.
std::optional<Time> Camera::expected_edge() const noexcept {
    if (edges_.empty()) return first_edge_ ? first_edge_ : router_.next_line_edge(clock_.now());
    const std::optional<Time> predicted = edges_.next();
    const sync::Trigger& last = router_.gate().current();
    if (last.next == sync::Trigger::unknown_edge)
        return predicted || !line_known_ ? predicted : router_.next_line_edge(last.edge);
    // With a divider the loop knows the distance of the edges, and the source their instant.
    const std::int64_t period_ns = last.next - last.edge;
    if (!predicted || period_ns <= 0) return last.next;
    const std::int64_t edges = (*predicted - last.edge + period_ns / 2) / period_ns;
    return edges <= 1 ? last.next : *predicted;
}

/// True if the next frame can be rendered before its trigger: what its light depends on is then in `next`,
/// and changes only if a client changes it or the edge comes at another time than expected.
bool Camera::expect_next(ExpectedFrame& next) noexcept {
    if (!config_.expects_frames || !maker_.renders_ahead() || frames_left_ == 0) return false;
    const bool follows = scene_clock_.follows_edges();
    const std::optional<Time> edge = follows ? expected_edge() : Time{};
    if (!edge) return false;
    const std::unique_lock lock(settings_mutex_, std::try_to_lock);
    CameraSettings settings = lock ? settings_ : frame_settings_;
    if (settings.exposure_mode == ExposureMode::trigger_width) return false;
    if (settings.exposure_auto != ExposureAuto::off) settings.exposure_ns = auto_exposure_.exposure_ns();
    order_light(settings,
                {.frame_id = next_frame_id_,
                 .nominal = nominal_scene_time(settings, trigger_rate_, next_frame_id_),
                 .edge = *edge,
                 .tai_offset_ns = clock_.tai_offset_ns()},
                next.order);
    next.edge = follows ? edge : expected_edge();
    next.tolerance_px = config_.ahead_tolerance_px;
    next.max_ahead_ns = config_.max_ahead_ns;
    next.exact_time = !follows;
    return true;
}

bool Camera::start_frame(FrameRef& frame) noexcept {
    take_settings();
    const FrameOrder order = next_order();
    if (--frames_left_ == 0) router_.gate().close_after_this();

    if (!releaser_.has_room() || !(frame = pool_.acquire())) {
        // Log once until frames are available again, not at every trigger.
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
    frame->info.sequence_step =
        frame_sequence_.enabled ? last_sequence_step_.load(std::memory_order_relaxed) : 0;
    if (const TriggerRoute route = route_of(frame_settings_); route != free_run_route)
        if (const std::size_t line = line_of(static_cast<TriggerSource>(route)); line < line_count)
            frame->info.line_status = line_status_line0 << line;
    router_.frame_begun(instants_of(order));
    frame->info.transmit = releaser_.transmit_timestamps();
    bool taken = false, sent = transports_.size() == 1 && viewers_ != nullptr; // nothing is to be sent
    for (transports::Transport* transport : transports_) {
        const bool took = transport->submit(frame);
        taken = taken || took;
        sent = sent || (took && transport != viewers_);
    }
    if (!taken) return false;
    if (!sent) unsent_.fetch_add(1, std::memory_order_relaxed);
    frames_.fetch_add(1, std::memory_order_relaxed);
    sink_ = &releaser_.begin(
        frame, maker_.plan().release, maker_.scene_to_clock_ns(),
        {.acquisition = maker_.acquisitions(), .min_period_ns = maker_.plan().frame_period_ns},
        router_.gate().current().request);
    // Cancel here if the abort came before begin() and could not reach this frame.
    if (cancel_.load()) releaser_.abandon_all();
    return true;
}

/// Instants of the frame prepared last, on the scheduling clock.
FrameInstants Camera::instants_of(const FrameOrder& order) const noexcept {
    const sensors::ReadoutPlan& plan = maker_.plan();
    const std::int64_t shift_ns = maker_.scene_to_clock_ns();
    Time first = plan.rows.front().reset, last = plan.rows.front().read;
    for (const RowTime& row : plan.rows) {
        first = std::min(first, row.reset);
        last = std::max(last, row.read);
    }
    return {order.frame_id, order.trigger_edge, plan.release.back() + shift_ns, first + shift_ns,
            last + shift_ns};
}

CameraCounters Camera::counters() const noexcept {
    const ReleaseCounters released = releaser_.counters();
    const sync::GateCounters gate = router_.counters();
    CameraCounters c;
    c.triggers = gate.edges + gate.lost;
    c.missed_triggers = gate.missed;
    c.missed_because = gate.missed_because;
    c.masked_triggers = gate.masked;
    c.latched_triggers = gate.latched;
    c.ignored = gate.ignored;
    c.dropped = dropped_.load(std::memory_order_relaxed);
    c.lod = maker_.lod_counters();
    c.frames = frames_.load(std::memory_order_relaxed);
    c.unsent = unsent_.load(std::memory_order_relaxed);
    c.complete = released.complete;
    c.late = released.late;
    c.late_rows = released.late_rows;
    c.stalled = released.stalled;
    c.stalled_rows = released.stalled_rows;
    c.failed = maker_.failed_frames();
    c.poses_held = maker_.frames_with_held_poses();
    c.values_replaced = maker_.sensor_values_replaced();
    c.abandoned = released.abandoned;
    c.repeated = released.repeated;
    c.late_dropped = released.dropped;
    c.partial = released.partial;
    c.ahead = maker_.ahead_counters();
    c.quality = maker_.quality_counters();
    return c;
}

} // namespace obscura::emulator
