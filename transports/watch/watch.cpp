// SPDX-License-Identifier: Apache-2.0
#include "transports/watch/watch.hpp"

#include "core/clock.hpp"

#include <unistd.h>

#include <algorithm>
#include <utility>

namespace obscura::transports {
namespace {

constexpr std::chrono::milliseconds look_period{50};
/// Who wants no pixels needs no more frames than these.
constexpr std::int64_t look_period_of_info_ns = 100 * ns_per_ms;

} // namespace

WatchTransport::WatchTransport(std::size_t most_pixels, std::function<void()> enter)
    : enter_(std::move(enter)),
      queue_(frames_held - 1),
      ring_(most_pixels),
      reader_(FileDescriptor(::dup(ring_.descriptor()))) {}

WatchTransport::~WatchTransport() {
    stop();
}

void WatchTransport::start() {
    stopping_ = false;
    thread_ = std::thread([this] {
        enter_();
        work();
    });
}

void WatchTransport::stop() {
    if (!thread_.joinable()) return;
    stopping_ = true;
    wake_.notify();
    thread_.join();
    for (; queue_.front(); ++taken_)
        queue_.pop();
}

bool WatchTransport::submit(const FrameRef& frame) noexcept {
    const std::int64_t now_ns = frame->info.seen.ns;
    if (now_ns > watched_until_.load(std::memory_order_relaxed)) return true;
    const std::uint64_t number = ++seen_;
    const std::int64_t period_ns = period_ns_.load(std::memory_order_relaxed);
    const bool too_soon = period_ns > 0 && now_ns < next_ns_;
    if (too_soon) {
        // Takes no place from those that are asked for.
        if (queued_ != taken_.load(std::memory_order_acquire)) return true;
    } else {
        next_ns_ = now_ns + period_ns;
        submitted_.fetch_add(1, std::memory_order_relaxed);
    }
    // One more place than the queue has: that of the next frame is free. By the end of a second period a
    // newer frame has come, unless there is none.
    places_[queued_ % places_.size()] = {number, too_soon ? next_ns_ + period_ns : 0};
    if (queue_.push(frame)) {
        ++queued_;
        wake_.notify();
    } else if (!too_soon) {
        dropped_.fetch_add(1, std::memory_order_relaxed);
    }
    return true;
}

TransportCounters WatchTransport::counters() const noexcept {
    return {submitted_.load(), delivered_.load(), dropped_.load(), bytes_.load()};
}

void WatchTransport::look(std::int64_t period_ns) {
    const std::lock_guard lock(mutex_);
    look_locked(period_ns);
}

void WatchTransport::look_locked(std::int64_t period_ns) {
    const std::int64_t now_ns = MonotonicClock().now().ns;
    if (now_ns > watched_until_) newest_number_ = newest_serial_ = 0; // frames have gone by since
    if (period_ns <= period_ns_ || now_ns > period_until_) {
        const bool sooner = period_ns < period_ns_;
        period_ns_ = period_ns;
        period_until_ = now_ns + watched_ns;
        if (sooner) wake_.notify();
    }
    watched_until_ = now_ns + watched_ns;
}

std::optional<WatchedFrame> WatchTransport::newest(std::uint64_t after,
                                                   std::chrono::steady_clock::time_point until,
                                                   const std::atomic<bool>& given_up) {
    WatchedFrame frame;
    std::unique_lock lock(mutex_);
    while (true) {
        look_locked(0);
        if (newest_number_ > after) {
            frame.number = newest_number_;
            frame.info = newest_info_;
            const std::uint64_t serial = newest_serial_;
            lock.unlock();
            if (const auto there = reader_.read(); there && there->serial == serial) {
                frame.flags = there->header.flags;
                frame.rows = static_cast<std::int32_t>(there->header.rows);
                frame.pixels.resize(there->pixels.size());
                if (reader_.copy(*there, frame.pixels)) return frame;
            }
            lock.lock();
        }
        const auto now = std::chrono::steady_clock::now();
        if (now >= until || given_up) return std::nullopt;
        if (newest_number_ <= after || newest_number_ == frame.number)
            changed_.wait_until(lock, std::min(until, now + look_period));
    }
}

std::optional<FrameInfo> WatchTransport::newest_info(std::chrono::steady_clock::time_point until,
                                                     const std::atomic<bool>& given_up) {
    std::unique_lock lock(mutex_);
    while (true) {
        look_locked(look_period_of_info_ns);
        if (newest_number_ > 0) return newest_info_;
        const auto now = std::chrono::steady_clock::now();
        if (now >= until || given_up) return std::nullopt;
        changed_.wait_until(lock, std::min(until, now + look_period));
    }
}

Time WatchTransport::due(const Place& place) const noexcept {
    return {period_ns_.load(std::memory_order_relaxed) > 0 ? place.not_before_ns : 0};
}

void WatchTransport::work() {
    FrameRef held; // came too soon, and is the newest one
    Place place;   // its own
    while (!stopping_) {
        const std::uint32_t seen = wake_.value();
        if (const FrameRef frame = queue_.front()) {
            held = {};
            place = places_[taken_ % places_.size()];
            if (place.not_before_ns == 0)
                copy(*frame, place.number);
            else
                held = frame;
            taken_.fetch_add(1, std::memory_order_release);
            queue_.pop();
        } else if (held && MonotonicClock().now() >= due(place)) {
            submitted_.fetch_add(1, std::memory_order_relaxed);
            copy(*held, place.number);
            held = {};
        } else if (!stopping_) {
            wake_.wait(seen, held ? due(place) : EventCount::never);
        }
    }
}

void WatchTransport::copy(const Frame& frame, std::uint64_t number) {
    frame.wait_rows(frame.info.height);
    const std::uint64_t serial = ring_.write(frame, number);
    if (serial == 0) {
        dropped_.fetch_add(1, std::memory_order_relaxed);
        return;
    }
    delivered_.fetch_add(1, std::memory_order_relaxed);
    bytes_.fetch_add(frame.pixels().size_bytes(), std::memory_order_relaxed);
    {
        const std::lock_guard lock(mutex_);
        newest_number_ = number;
        newest_serial_ = serial;
        newest_info_ = frame.info;
        newest_info_.transmit = nullptr;
    }
    changed_.notify_all();
}

} // namespace obscura::transports
