#include "emulator/releaser.hpp"

#include "core/realtime.hpp"

#include <algorithm>
#include <cassert>

namespace obscura::emulator {

Releaser::Releaser(ReleaserSettings settings, std::unique_ptr<Clock> clock)
    : settings_(settings), clock_(std::move(clock)) {
    for (Job& job : jobs_) {
        job.clock = clock_.get();
        job.release.reserve(settings_.max_rows);
    }
    thread_ = std::thread([this] {
        name_this_thread("release");
        if (settings_.priority > 0) make_this_thread_realtime(settings_.priority);
        declare_this_thread_realtime();
        run();
    });
}

Releaser::~Releaser() {
    stopping_ = true;
    abandon_all();
    // A number that was not begun wakes the thread; it looks at stopping_ first.
    begun_.fetch_add(1);
    begun_.notify_all();
    thread_.join();
}

bool Releaser::has_room() const noexcept {
    return begun_.load(std::memory_order_relaxed) - finished_.load(std::memory_order_acquire) <
           frames_in_flight;
}

RowSink& Releaser::begin(const FrameRef& frame, const std::vector<Time>& release,
                         std::int64_t shift_ns) noexcept {
    assert(has_room() && release.size() <= settings_.max_rows);
    const std::uint32_t number = begun_.load(std::memory_order_relaxed);
    Job& job = jobs_[number % frames_in_flight];
    job.frame = frame;
    job.target = frame.get();
    job.release.resize(release.size());
    std::transform(release.begin(), release.end(), job.release.begin(),
                   [shift_ns](Time t) { return t + shift_ns; });
    job.late_rows = 0;
    job.exposed.store(0, std::memory_order_relaxed);
    begun_.store(number + 1, std::memory_order_release);
    begun_.notify_all();
    return job;
}

void Releaser::Job::rows_exposed(std::int32_t rows) noexcept {
    const auto before = static_cast<std::int32_t>(exposed.load(std::memory_order_relaxed) & ~cancelled);
    const auto first = release.begin() + before, last = release.begin() + rows;
    // Rows whose time has passed before they were ready. Release times grow with the row.
    const auto late = std::lower_bound(first, last, clock->now()) - first;
    if (late > 0) {
        late_rows += static_cast<std::uint32_t>(late);
        target->flags.fetch_or(frame_late, std::memory_order_relaxed);
    }
    // Added, not stored: the bit may be set meanwhile by another thread and must stay.
    exposed.fetch_add(static_cast<std::uint32_t>(rows - before), std::memory_order_release);
    exposed.notify_all();
}

void Releaser::cancel() noexcept {
    const std::uint32_t number = begun_.load(std::memory_order_relaxed) - 1;
    Job& job = jobs_[number % frames_in_flight];
    job.exposed.fetch_or(Job::cancelled, std::memory_order_release);
    job.exposed.notify_all();
    clock_->interrupt();
}

void Releaser::abandon_all() noexcept {
    for (Job& job : jobs_) {
        job.exposed.fetch_or(Job::cancelled, std::memory_order_release);
        job.exposed.notify_all();
    }
    clock_->interrupt();
}

void Releaser::wait_idle() const noexcept {
    for (std::uint32_t finished = finished_.load(std::memory_order_acquire); finished != begun_.load();
         finished = finished_.load(std::memory_order_acquire))
        finished_.wait(finished, std::memory_order_acquire);
}

ReleaseCounters Releaser::counters() const noexcept {
    return {complete_.load(std::memory_order_relaxed), late_.load(std::memory_order_relaxed),
            late_rows_.load(std::memory_order_relaxed), abandoned_.load(std::memory_order_relaxed)};
}

void Releaser::run() noexcept {
    for (std::uint32_t number = 0;; ++number) {
        while (begun_.load(std::memory_order_acquire) == number)
            begun_.wait(number, std::memory_order_acquire);
        Job& job = jobs_[number % frames_in_flight];
        // Frames begun before the end are still given up properly, so that no transport waits for ever.
        if (!job.frame) return;
        if (release_frame(job)) {
            complete_.fetch_add(1, std::memory_order_relaxed);
            if (job.late_rows > 0) late_.fetch_add(1, std::memory_order_relaxed);
            late_rows_.fetch_add(job.late_rows, std::memory_order_relaxed);
        } else {
            job.frame->abandon();
            abandoned_.fetch_add(1, std::memory_order_relaxed);
        }
        job.frame = FrameRef();
        finished_.store(number + 1, std::memory_order_release);
        finished_.notify_all();
    }
}

bool Releaser::release_frame(Job& job) noexcept {
    Frame& frame = *job.frame;
    const auto height = static_cast<std::int32_t>(job.release.size());
    for (std::int32_t released = 0; released < height;) {
        const std::uint32_t exposed = job.exposed.load(std::memory_order_acquire);
        if ((exposed & Job::cancelled) != 0 || stopping_.load(std::memory_order_relaxed)) return false;
        const auto ready = static_cast<std::int32_t>(exposed);
        if (ready == released) {
            job.exposed.wait(exposed, std::memory_order_acquire);
            continue;
        }
        const auto next = job.release.begin() + released, end = job.release.begin() + ready;
        Time now = clock_->now();
        if (now < *next) {
            // The first row leaves at its very moment; later ones in groups, or the thread would wake for
            // each.
            const Time until = released == 0 ? *next : std::min(*(end - 1), *next + settings_.grain_ns);
            if (!clock_->sleep_until(until)) clock_->rearm();
            continue;
        }
        if (released == 0) first_row_.add(now - frame.info.trigger_edge);
        released = static_cast<std::int32_t>(std::upper_bound(next, end, now) - job.release.begin());
        frame.publish_rows(released);
    }
    last_row_.add(clock_->now() - frame.info.trigger_edge);
    return true;
}

} // namespace obscura::emulator
