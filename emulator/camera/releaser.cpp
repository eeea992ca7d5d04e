// SPDX-License-Identifier: Apache-2.0
#include "emulator/camera/releaser.hpp"

#include "core/camera/frame_flags.hpp"
#include "core/realtime/realtime.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

namespace obscura::emulator {

Releaser::Releaser(ReleaserSettings settings, std::unique_ptr<Clock> clock, TimingLog* log)
    : settings_(settings),
      clock_(std::move(clock)),
      log_(log),
      policy_(settings.policy),
      grace_ns_(settings.grace_ns) {
    for (Job& job : jobs_) {
        job.clock = clock_.get();
        job.changed = &changed_;
        job.release.reserve(settings_.max_rows);
        job.ready_late.resize(settings_.max_rows);
    }
    thread_ = std::thread([this] {
        enter_thread(heartbeat_.name().c_str(), settings_.thread);
        declare_this_thread_realtime();
        run();
    });
}

Releaser::~Releaser() {
    stopping_ = true;
    abandon_all();
    // Count a frame that was not begun, to wake the thread; it checks stopping_ first.
    begun_.fetch_add(1);
    changed_.notify();
    thread_.join();
}

void Releaser::set_late_policy(LatePolicy policy, std::int64_t grace_ns) noexcept {
    policy_.store(policy, std::memory_order_relaxed);
    grace_ns_.store(grace_ns, std::memory_order_relaxed);
}

bool Releaser::has_room() const noexcept {
    return begun_.load(std::memory_order_relaxed) - finished_.load(std::memory_order_acquire) <
           frames_in_flight;
}

TransmitTimestamps* Releaser::transmit_timestamps() noexcept {
    return log_ == nullptr ? nullptr : &log_->transmit_timestamps(begun_.load(std::memory_order_relaxed));
}

RowSink& Releaser::begin(const FrameRef& frame, const std::vector<Time>& release, std::int64_t shift_ns,
                         const FrameFacts& facts, std::uint64_t request) noexcept {
    assert(has_room() && release.size() <= settings_.max_rows);
    const std::uint32_t number = begun_.load(std::memory_order_relaxed);
    Job& job = jobs_[number % frames_in_flight];
    job.frame = frame;
    job.timing = settings_.timing;
    job.policy =
        job.timing == ReadoutTiming::fast ? LatePolicy::late : policy_.load(std::memory_order_relaxed);
    job.grace_ns = grace_ns_.load(std::memory_order_relaxed);
    job.wake_clock = job.policy != LatePolicy::late;
    job.target = frame.get();
    job.release.resize(release.size());
    std::transform(release.begin(), release.end(), job.release.begin(),
                   [shift_ns](Time t) { return t + shift_ns; });
    job.facts = facts;
    job.request = request;
    job.work = {};
    job.late_rows.store(0, std::memory_order_relaxed);
    job.unwanted.store(false, std::memory_order_relaxed);
    job.exposed.store(0, std::memory_order_relaxed);
    begun_.store(number + 1);
    changed_.notify();
    return job;
}

const std::atomic<bool>& Releaser::cancel_flag() const noexcept {
    return newest().unwanted;
}

void Releaser::Job::rows_exposed(std::int32_t rows) noexcept {
    const auto before = static_cast<std::int32_t>(exposed.load(std::memory_order_relaxed) & rows_mask);
    const auto first = release.begin() + before, last = release.begin() + rows;
    const Time now = clock->now();
    if (timing == ReadoutTiming::fast) std::fill(first, last, now);
    // Count the rows that were ready after their release time. Release times grow with the row.
    const auto late = std::lower_bound(first, last, now) - first;
    const auto marks = ready_late.begin() + before;
    std::fill(marks, marks + late, std::uint8_t{1});
    std::fill(marks + late, ready_late.begin() + rows, std::uint8_t{0});
    if (late > 0 && !unwanted.load(std::memory_order_relaxed)) {
        late_rows.fetch_add(static_cast<std::uint32_t>(late), std::memory_order_relaxed);
        target->flags.fetch_or(frame_late, std::memory_order_relaxed);
    }
    // Add instead of store: another thread may set flag bits meanwhile, which must be kept.
    exposed.fetch_add(static_cast<std::uint32_t>(rows - before), std::memory_order_release);
    changed->notify();
    if (wake_clock) clock->interrupt();
}

void Releaser::Job::set_bits(std::uint32_t bits) noexcept {
    if ((bits & cancelled) != 0) unwanted.store(true, std::memory_order_relaxed);
    exposed.fetch_or(bits, std::memory_order_release);
    changed->notify();
}

void Releaser::end(bool complete) noexcept {
    newest().set_bits(Job::filled | (complete ? 0 : Job::cancelled));
    if (!complete || newest().wake_clock) clock_->interrupt();
}

void Releaser::abandon_all() noexcept {
    for (Job& job : jobs_)
        job.set_bits(Job::cancelled);
    clock_->interrupt();
}

void Releaser::wait_idle() const noexcept {
    for (std::uint32_t finished = finished_.load(std::memory_order_acquire); finished != begun_.load();
         finished = finished_.load(std::memory_order_acquire))
        finished_.wait(finished, std::memory_order_acquire);
}

ReleaseCounters Releaser::counters() const noexcept {
    const auto read = [](const std::atomic<std::uint64_t>& n) { return n.load(std::memory_order_relaxed); };
    return {complete_.load(std::memory_order_acquire),
            read(late_),
            read(late_rows_),
            read(stalled_),
            read(stalled_rows_),
            read(abandoned_),
            read(repeated_),
            read(dropped_),
            read(partial_),
            read(spins_denied_)};
}

void Releaser::run() noexcept {
    for (std::uint32_t number = 0;; ++number) {
        for (;;) {
            const std::uint32_t seen = changed_.value();
            if (begun_.load(std::memory_order_acquire) != number) break;
            wait_for_change(seen);
        }
        Job& job = jobs_[number % frames_in_flight];
        // Abandon frames begun before the end, so that no transport waits forever.
        if (!job.frame) return;
        Frame& frame = *job.frame;
        FrameTiming timing;
        if (log_ != nullptr) timing.row_lateness_us = log_->next_rows(job.release.size());
        FrameOutcome outcome = release_frame(job, timing);
        const bool at_once = job.timing == ReadoutTiming::fast;
        timing.due = at_once ? timing.first : job.release.front();
        timing.last_due = at_once ? timing.last : job.release.back();
        const std::uint32_t late_rows = job.late_rows.load(std::memory_order_relaxed);
        late_rows_.fetch_add(late_rows, std::memory_order_relaxed);
        stalled_rows_.fetch_add(timing.stalled_rows, std::memory_order_relaxed);
        const bool whole = outcome == FrameOutcome::complete || outcome == FrameOutcome::repeated;
        if (whole) {
            // Store the count of frames last, so that a reader of the count sees the frame's other counters.
            if (late_rows > 0) late_.fetch_add(1, std::memory_order_relaxed);
            if (late_rows > 0 && outcome == FrameOutcome::complete) outcome = FrameOutcome::late;
            if (timing.stalled_rows > 0) stalled_.fetch_add(1, std::memory_order_relaxed);
            complete_.fetch_add(1, std::memory_order_release);
            last_complete_ = job.policy == LatePolicy::repeat ? job.frame : FrameRef();
        } else {
            job.unwanted.store(true, std::memory_order_relaxed);
            frame.abandon();
            abandoned_.fetch_add(1, std::memory_order_release);
        }
        if (log_ != nullptr) {
            const FrameInfo& info = frame.info;
            timing.frame_id = info.frame_id;
            timing.trigger_id = info.trigger_id;
            timing.edge = info.trigger_edge;
            timing.seen = info.seen;
            timing.rows = static_cast<std::uint32_t>(job.release.size());
            timing.late_rows = late_rows;
            timing.flags = reported_flags(frame);
            timing.pose = info.pose;
            timing.transmit = info.transmit;
            timing.facts = job.facts;
            timing.width = info.width;
            timing.height = info.height;
            timing.ended = clock_->now();
            // Leave out the other stamps: threads may still write them for a frame abandoned early.
            if (frame.complete()) {
                timing.render_begin = info.render_begin;
                timing.render_end = info.render_end;
                timing.detector_end = info.detector_end;
                timing.work = job.work;
                timing.quality = info.quality;
            }
            log_->push(timing);
        }
        const OutcomeRecord record{
            frame.info.frame_id, frame.info.trigger_id, job.request,           job.facts.acquisition,
            late_rows,           timing.stalled_rows,   reported_flags(frame), outcome};
        job.frame = FrameRef();
        // Sequentially consistent: notify_all() checks for waiters first, and with a weaker store that check
        // may precede the store. A waiter that arrives in between would then sleep forever.
        finished_.store(number + 1);
        finished_.notify_all();
        outcomes_.publish(record);
    }
}

FrameOutcome Releaser::release_frame(Job& job, FrameTiming& timing) noexcept {
    Frame& frame = *job.frame;
    const auto height = static_cast<std::int32_t>(job.release.size());
    for (std::int32_t released = 0; released < height;) {
        heartbeat_.beat();
        const std::uint32_t seen = changed_.value();
        const std::uint32_t exposed = job.exposed.load(std::memory_order_acquire);
        if ((exposed & Job::cancelled) != 0 || stopping_.load(std::memory_order_relaxed))
            return FrameOutcome::abandoned;
        const auto ready = static_cast<std::int32_t>(exposed & Job::rows_mask);
        const auto next = job.release.begin() + released, end = job.release.begin() + ready;
        const Time now = clock_->now();
        if (ready == released) {
            if (job.policy == LatePolicy::late) {
                wait_for_change(seen);
            } else if (now > *next + job.grace_ns) {
                return miss(job, released, timing);
            } else {
                sleep_until(*next + job.grace_ns + 1, false);
            }
            continue;
        }
        if (now < *next) {
            // Release the first row exactly at its time, later rows in groups, or the thread would wake for
            // each row.
            const bool first = released == 0;
            sleep_until(first ? *next : std::min(*(end - 1), *next + settings_.grain_ns), first);
            if (first && clock_->now() >= *next) lateness_.add(clock_->now() - *next);
            continue;
        }
        if (now - *next > timing.worst_row_ns || released == 0) {
            timing.worst_row_ns = now - *next;
            timing.worst_row = static_cast<std::uint32_t>(released);
        }
        if (released == 0) {
            timing.first = now;
            first_row_.add(now - frame.info.trigger_edge);
        }
        const std::int32_t before = released;
        released = static_cast<std::int32_t>(std::upper_bound(next, end, now) - job.release.begin());
        if (const std::uint32_t stalled = stalled_rows(job, before, released, now); stalled > 0) {
            timing.stalled_rows += stalled;
            frame.flags.fetch_or(frame_stalled, std::memory_order_relaxed);
        }
        frame.publish_rows(released);
        if (!timing.row_lateness_us.empty())
            for (std::int32_t row = before; row < released; ++row)
                timing.row_lateness_us[static_cast<std::size_t>(row)] = static_cast<std::int32_t>(
                    std::min<std::int64_t>((now - job.release[static_cast<std::size_t>(row)]) / ns_per_us,
                                           FrameTiming::not_released - 1));
    }
    timing.last = clock_->now();
    last_row_.add(timing.last - frame.info.trigger_edge);
    return FrameOutcome::complete;
}

std::uint32_t Releaser::stalled_rows(const Job& job, std::int32_t from, std::int32_t to, Time now) noexcept {
    // Fast, a row is due when it is ready.
    if (job.timing == ReadoutTiming::fast) return 0;
    const auto first = job.release.begin() + from;
    const auto stalled = std::lower_bound(first, job.release.begin() + to, now - release_stall_ns) - first;
    const auto marks = job.ready_late.begin() + from;
    return static_cast<std::uint32_t>(std::count(marks, marks + stalled, std::uint8_t{0}));
}

FrameOutcome Releaser::miss(Job& job, std::int32_t released, FrameTiming& timing) noexcept {
    Frame& frame = *job.frame;
    job.unwanted.store(true, std::memory_order_relaxed);
    job.late_rows.fetch_add(static_cast<std::uint32_t>(job.release.size()) -
                                static_cast<std::uint32_t>(released),
                            std::memory_order_relaxed);
    frame.flags.fetch_or(frame_late, std::memory_order_relaxed);
    if (job.policy == LatePolicy::repeat && repeat_last(job, released)) {
        const Time now = clock_->now();
        if (released == 0) {
            timing.first = now;
            first_row_.add(now - frame.info.trigger_edge);
        }
        timing.last = now;
        last_row_.add(now - frame.info.trigger_edge);
        repeated_.fetch_add(1, std::memory_order_relaxed);
        return FrameOutcome::repeated;
    }
    if (job.policy == LatePolicy::partial) {
        partial_.fetch_add(1, std::memory_order_relaxed);
        return FrameOutcome::partial;
    }
    frame.flags.fetch_or(frame_dropped, std::memory_order_relaxed);
    dropped_.fetch_add(1, std::memory_order_relaxed);
    return FrameOutcome::dropped;
}

bool Releaser::repeat_last(Job& job, std::int32_t from) noexcept {
    Frame& frame = *job.frame;
    const bool fits = last_complete_ && last_complete_->info.width == frame.info.width &&
                      last_complete_->info.height == frame.info.height;
    if (!fits) return false;
    // Renderer and detector stop writing to the frame at the end of their row block.
    for (;;) {
        const std::uint32_t seen = changed_.value();
        if ((job.exposed.load(std::memory_order_acquire) & Job::filled) != 0) break;
        if (stopping_.load(std::memory_order_relaxed)) return false;
        wait_for_change(seen);
    }
    const auto offset = static_cast<std::size_t>(from) * static_cast<std::size_t>(frame.info.width);
    const auto source = std::as_const(*last_complete_).pixels().subspan(offset);
    std::copy(source.begin(), source.end(), frame.pixels().subspan(offset).begin());
    frame.flags.fetch_or(frame_repeated, std::memory_order_relaxed);
    frame.publish_rows(frame.info.height);
    return true;
}

void Releaser::wait_for_change(std::uint32_t seen) noexcept {
    heartbeat_.beat();
    changed_.wait(seen, MonotonicClock().now() + Heartbeat::max_wait_ns);
}

void Releaser::sleep_until(Time t, bool exactly) noexcept {
    // Sleep in pieces, so that a long exposure is not taken for a hung thread.
    if (const Time soon = clock_->now() + Heartbeat::max_wait_ns; t > soon) {
        t = soon;
        exactly = false;
    }
    const bool spin = exactly && settings_.spin_ns > 0 && may_spin(clock_->now());
    if (!clock_->sleep_until(spin ? t - settings_.spin_ns : t)) {
        clock_->rearm();
        return;
    }
    if (!spin) return;
    const Time begin = clock_->now();
    Time now = begin;
    while (now < t && now - begin < settings_.spin_ns)
        now = clock_->now();
    spun_ns_ += now - begin;
}

// Limits polling to a fifth of any second. SCHED_FIFO threads that use up sched_rt_runtime_us are throttled
// for the rest of the period; this stays far below that limit.
bool Releaser::may_spin(Time now) noexcept {
    if (now - spin_window_ >= ns_per_s) {
        spin_window_ = now;
        spun_ns_ = 0;
    }
    if (spun_ns_ + settings_.spin_ns <= ns_per_s / 5) return true;
    spins_denied_.fetch_add(1, std::memory_order_relaxed);
    return false;
}

} // namespace obscura::emulator
