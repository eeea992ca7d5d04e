#include "emulator/camera.hpp"

#include "core/realtime.hpp"

#include <utility>

namespace obscura::emulator {

Time nominal_scene_time(const CameraSettings& settings, sync::RationalRate trigger_rate,
                        std::uint64_t frame_id) {
    const sync::RationalRate rate =
        settings.trigger_enabled ? trigger_rate : sync::rational_rate(settings.frame_rate_hz);
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
      route_(route_of(config.initial)),
      frame_settings_(config.initial) {
    thread_ = std::thread([this] {
        name_this_thread("pipeline");
        if (config_.priority > 0) make_this_thread_realtime(config_.priority);
        declare_this_thread_realtime();
        run();
    });
}

Camera::~Camera() {
    acquisition_stop(true);
    state_.fetch_or(quit_bit);
    state_.notify_all();
    thread_.join();
}

Camera::Route Camera::route_of(const CameraSettings& s) noexcept {
    if (!s.trigger_enabled) return Route::free_run;
    switch (s.trigger_source) {
    case TriggerSource::software:
        return Route::software;
    case TriggerSource::action1:
        return Route::action;
    case TriggerSource::line0:
        break;
    }
    return Route::line0;
}

CameraSettings Camera::settings() const {
    const std::lock_guard lock(settings_mutex_);
    return settings_;
}

bool Camera::apply(const CameraSettings& settings) {
    if (!explain_invalid(settings, config_.limits).empty()) return false;
    const std::lock_guard control(control_mutex_);
    const CameraSettings before = this->settings();
    {
        const std::lock_guard lock(settings_mutex_);
        settings_ = settings;
    }
    const bool paced_differently =
        route_of(before) != route_of(settings) || before.frame_rate_hz != settings.frame_rate_hz;
    if (paced_differently) {
        stop_free_run();
        route_.store(route_of(settings));
        forget_edges();
        if (acquiring()) start_free_run();
    }
    return true;
}

bool Camera::acquisition_start() {
    const std::lock_guard control(control_mutex_);
    if (acquiring()) return false;
    stop_free_run(); // of an acquisition that ended by itself
    wait_until_handed_over(false);
    const CameraSettings now = settings();
    next_frame_id_ = 1;
    frames_left_ = now.acquisition_mode == AcquisitionMode::single_frame  ? 1
                   : now.acquisition_mode == AcquisitionMode::multi_frame ? now.acquisition_frame_count
                                                                          : UINT64_MAX;
    acquisition_begin_ = clock_.now();
    not_before_ns_ = INT64_MIN;
    forget_edges();
    state_.fetch_or(acquiring_bit, std::memory_order_release);
    start_free_run();
    return true;
}

void Camera::acquisition_stop(bool abort) {
    const std::lock_guard control(control_mutex_);
    stop_free_run();
    if (abort) {
        cancel_ = true;
        releaser_.abandon_all();
    }
    state_.fetch_and(~acquiring_bit);
    wait_until_handed_over(abort);
    if (abort) {
        releaser_.abandon_all(); // a frame that was ready and waited for its time
        releaser_.wait_idle();
        cancel_ = false;
    }
}

void Camera::wait_until_handed_over(bool also_made) const noexcept {
    for (;;) {
        const std::uint32_t state = state_.load(std::memory_order_acquire);
        const std::uint32_t phase = state & phase_mask;
        if (phase == phase_ready || (phase == phase_working && !also_made)) return;
        state_.wait(state, std::memory_order_acquire);
    }
}

bool Camera::acquiring() const {
    return (state_.load(std::memory_order_acquire) & acquiring_bit) != 0;
}

bool Camera::trigger_ready() const noexcept {
    return state_.load(std::memory_order_relaxed) == (phase_ready | acquiring_bit);
}

void Camera::start_free_run() {
    if (route_.load() != Route::free_run) return;
    sync::TimerSettings timer;
    timer.rate = sync::rational_rate(settings().frame_rate_hz);
    timer.priority = config_.priority;
    free_run_ = std::make_unique<sync::TimerTrigger>(timer, std::make_unique<MonotonicClock>());
    free_run_->start(free_run_sink_);
}

void Camera::stop_free_run() {
    free_run_.reset();
}

bool Camera::software_trigger(Time edge) {
    return take({software_edges_.fetch_add(1) + 1, edge, clock_.now()}, Route::software);
}

void Camera::on_trigger(const sync::Trigger& trigger) noexcept {
    take(trigger, Route::line0);
}

void Camera::FreeRunSink::on_trigger(const sync::Trigger& trigger) noexcept {
    camera.take(trigger, Route::free_run);
}

bool Camera::take(const sync::Trigger& trigger, Route from) noexcept {
    std::uint32_t state = state_.load(std::memory_order_acquire);
    if ((state & acquiring_bit) == 0 || route_.load(std::memory_order_relaxed) != from) {
        ignored_.fetch_add(1, std::memory_order_relaxed);
        last_edge_id_[static_cast<std::size_t>(from)].store(0, std::memory_order_relaxed);
        return false;
    }
    count_lost(trigger, from);
    triggers_.fetch_add(1, std::memory_order_relaxed);
    constexpr std::uint32_t ready = phase_ready | acquiring_bit;
    std::uint32_t expected = ready;
    if (trigger.edge.ns < not_before_ns_.load(std::memory_order_relaxed) ||
        !state_.compare_exchange_strong(expected, phase_writing | acquiring_bit, std::memory_order_acq_rel)) {
        missed_.fetch_add(1, std::memory_order_relaxed);
        return false;
    }
    slot_ = trigger;
    set_phase(phase_writing, phase_full);
    return true;
}

void Camera::count_lost(const sync::Trigger& trigger, Route from) noexcept {
    const std::uint64_t last =
        last_edge_id_[static_cast<std::size_t>(from)].exchange(trigger.id, std::memory_order_relaxed);
    if (last == 0 || trigger.id <= last + 1) return;
    triggers_.fetch_add(trigger.id - last - 1, std::memory_order_relaxed);
    missed_.fetch_add(trigger.id - last - 1, std::memory_order_relaxed);
}

void Camera::forget_edges() noexcept {
    for (std::atomic<std::uint64_t>& id : last_edge_id_)
        id.store(0, std::memory_order_relaxed);
}

bool Camera::alive() noexcept {
    const bool busy = (state_.load(std::memory_order_acquire) & phase_mask) != phase_ready;
    const std::uint64_t progress = frames_.load(std::memory_order_relaxed) + maker_.bands_made();
    const bool moved = progress != std::exchange(last_progress_, progress);
    return !busy || moved;
}

void Camera::set_phase(std::uint32_t from, std::uint32_t to) noexcept {
    state_.fetch_xor(from ^ to, std::memory_order_acq_rel);
    state_.notify_all();
}

void Camera::run() noexcept {
    for (;;) {
        const std::uint32_t state = state_.load(std::memory_order_acquire);
        if ((state & phase_mask) == phase_full) {
            make_frame();
        } else if ((state & quit_bit) != 0) {
            return;
        } else {
            state_.wait(state, std::memory_order_acquire);
        }
    }
}

void Camera::make_frame() noexcept {
    FrameRef frame;
    if (start_frame(frame)) {
        set_phase(phase_full, phase_working);
        if (!maker_.fill(*frame, sink_, &cancel_)) releaser_.cancel();
        set_phase(phase_working, phase_ready);
    } else {
        dropped_.fetch_add(1, std::memory_order_relaxed);
        set_phase(phase_full, phase_ready);
    }
}

bool Camera::start_frame(FrameRef& frame) noexcept {
    // Whoever holds the lock is about to change settings that were not meant for this frame.
    if (settings_mutex_.try_lock()) {
        frame_settings_ = settings_;
        settings_mutex_.unlock();
    }
    FrameOrder order;
    order.frame_id = next_frame_id_++;
    order.trigger_id = slot_.id;
    order.trigger_edge = slot_.edge;
    order.seen = slot_.seen;
    order.tai_offset_ns = clock_.tai_offset_ns();
    order.settings = frame_settings_;
    order.scene_time = config_.scene_time == SceneTime::nominal
                           ? nominal_scene_time(frame_settings_, config_.trigger_rate, order.frame_id)
                           : Time{slot_.edge - acquisition_begin_};
    if (--frames_left_ == 0) state_.fetch_and(~acquiring_bit);

    if (!releaser_.has_room() || !(frame = pool_.acquire())) {
        log_.push({clock_.now(),
                   LogLevel::warning,
                   "frame {} dropped: every frame of the pool is in use",
                   {static_cast<std::int64_t>(order.frame_id)}});
        return false;
    }
    if (!maker_.prepare(order, *frame).empty()) {
        log_.push({clock_.now(),
                   LogLevel::error,
                   "frame {} dropped: the chip cannot read these windows",
                   {static_cast<std::int64_t>(order.frame_id)}});
        return false;
    }
    not_before_ns_.store((slot_.edge + maker_.plan().frame_period_ns).ns, std::memory_order_relaxed);
    bool taken = false;
    for (transports::Transport* transport : transports_)
        taken = transport->submit(frame) || taken;
    if (!taken) return false;
    frames_.fetch_add(1, std::memory_order_relaxed);
    sink_ = &releaser_.begin(frame, maker_.plan().release, maker_.scene_to_clock_ns());
    return true;
}

CameraCounters Camera::counters() const noexcept {
    const ReleaseCounters released = releaser_.counters();
    CameraCounters c;
    c.triggers = triggers_.load(std::memory_order_relaxed);
    c.missed_triggers = missed_.load(std::memory_order_relaxed);
    c.ignored = ignored_.load(std::memory_order_relaxed);
    c.dropped = dropped_.load(std::memory_order_relaxed);
    c.frames = frames_.load(std::memory_order_relaxed);
    c.complete = released.complete;
    c.late = released.late;
    c.late_rows = released.late_rows;
    c.abandoned = released.abandoned;
    return c;
}

} // namespace obscura::emulator
