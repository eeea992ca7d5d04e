// SPDX-License-Identifier: Apache-2.0
#include "transports/watch/watch.hpp"

#include "core/clock.hpp"

#include <unistd.h>

#include <algorithm>
#include <utility>

namespace obscura::transports {
namespace {

constexpr std::chrono::milliseconds poll_interval{50};
/// Poll interval of viewers that need no pixels.
constexpr std::int64_t poll_interval_of_info_ns = 100 * ns_per_ms;

} // namespace

WatchTransport::WatchTransport(std::size_t max_pixels, std::function<void()> enter)
    : enter_(std::move(enter)),
      queue_(queued_frames),
      ring_(max_pixels),
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
    while (take_unseen().first) {
    }
}

/// On the pipeline thread.
void WatchTransport::keep(const FrameRef& frame, std::uint64_t number) noexcept {
    bool kept = false;
    for (Unseen& unseen : unseen_) {
        if (unseen.taken.exchange(true, std::memory_order_acquire)) continue;
        unseen.frame = kept ? FrameRef() : frame; // one older than this is of no use
        unseen.number = number;
        kept = true;
        unseen.taken.store(false, std::memory_order_release);
    }
    unseen_number_.store(number, std::memory_order_release);
}

std::pair<FrameRef, std::uint64_t> WatchTransport::take_unseen() noexcept {
    std::pair<FrameRef, std::uint64_t> newest;
    for (Unseen& unseen : unseen_) {
        while (unseen.taken.exchange(true, std::memory_order_acquire))
            std::this_thread::yield(); // the pipeline is at it, for a few instructions
        FrameRef frame = std::exchange(unseen.frame, FrameRef());
        if (frame && unseen.number > newest.second) newest = {std::move(frame), unseen.number};
        unseen.taken.store(false, std::memory_order_release);
    }
    return newest;
}

bool WatchTransport::submit(const FrameRef& frame) noexcept {
    const std::int64_t now_ns = frame->info.seen.ns;
    const std::uint64_t number = ++seen_;
    if (now_ns > watched_until_.load(std::memory_order_relaxed)) {
        keep(frame, number);
        return true;
    }
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

void WatchTransport::count_saturated() {
    saturated_.want(MonotonicClock().now() + watched_ns);
    look(0);
}

void WatchTransport::look_locked(std::int64_t period_ns) {
    const std::int64_t now_ns = MonotonicClock().now().ns;
    if (now_ns > watched_until_ && unseen_number_.load(std::memory_order_acquire) > newest_number_) {
        newest_number_ = 0; // frames have gone by since, the last of which is kept
        unseen_wanted_.store(true, std::memory_order_release);
        wake_.notify();
    }
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
    std::unique_lock lock(mutex_);
    while (true) {
        look_locked(0);
        std::uint64_t overwritten = 0;
        if (newest_number_ > after) {
            const Known known = known_[newest_];
            lock.unlock();
            if (auto frame = copy_of(known)) return frame;
            overwritten = known.number;
            lock.lock();
        }
        const auto now = std::chrono::steady_clock::now();
        if (now >= until || given_up) return std::nullopt;
        if (newest_number_ <= after || newest_number_ == overwritten)
            changed_.wait_until(lock, std::min(until, now + poll_interval));
    }
}

std::optional<WatchedFrame> WatchTransport::numbered(std::uint64_t number) {
    std::unique_lock lock(mutex_);
    const auto found = std::find_if(known_.begin(), known_.end(),
                                    [number](const Known& known) { return known.number == number; });
    if (number == 0 || found == known_.end()) return std::nullopt;
    const Known known = *found;
    lock.unlock();
    return copy_of(known);
}

std::optional<WatchedFrame> WatchTransport::copy_of(const Known& known) const {
    const auto there = reader_.read(known.serial);
    if (!there) return std::nullopt;
    WatchedFrame frame{
        known.number, known.info, there->header.flags, static_cast<std::int32_t>(there->header.rows), {}};
    frame.pixels.resize(there->pixels.size());
    if (!reader_.copy(*there, frame.pixels)) return std::nullopt;
    return frame;
}

std::optional<FrameInfo> WatchTransport::newest_info(std::chrono::steady_clock::time_point until,
                                                     const std::atomic<bool>& given_up) {
    std::unique_lock lock(mutex_);
    while (true) {
        look_locked(poll_interval_of_info_ns);
        if (newest_number_ > 0) return known_[newest_].info;
        const auto now = std::chrono::steady_clock::now();
        if (now >= until || given_up) return std::nullopt;
        changed_.wait_until(lock, std::min(until, now + poll_interval));
    }
}

std::optional<KeptFrame> WatchTransport::kept(std::uint64_t frame_id,
                                              std::chrono::steady_clock::time_point until,
                                              const std::atomic<bool>& given_up) {
    if (!newest_info(until, given_up)) return std::nullopt;
    // Ids begin anew with each acquisition: of several the newest one.
    const auto rank = [frame_id](const Known& known) {
        return std::pair(known.serial > 0 && frame_id > 0 && known.info.frame_id == frame_id, known.serial);
    };
    const std::lock_guard lock(mutex_);
    const auto found = std::max_element(
        known_.begin(), known_.end(), [&rank](const Known& a, const Known& b) { return rank(a) < rank(b); });
    const auto there = reader_.read(found->serial);
    if (!there) return std::nullopt;
    return KeptFrame{found->serial, found->info, there->header.flags,
                     static_cast<std::int32_t>(there->header.rows),
                     details_[found->serial % details_.size()].row_times};
}

std::optional<KeptPixel> WatchTransport::pixel(const KeptFrame& frame, std::int32_t x, std::int32_t y) {
    const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.info.width) +
                           static_cast<std::size_t>(x);
    KeptPixel pixel;
    {
        const std::lock_guard lock(mutex_);
        const std::size_t place = frame.serial % known_.size();
        if (known_[place].serial != frame.serial) return std::nullopt;
        if (at < details_[place].mean_e.size()) pixel.mean_e = details_[place].mean_e[at];
    }
    const auto there = reader_.read(frame.serial);
    if (!there || at >= there->pixels.size()) return std::nullopt;
    pixel.dn = __atomic_load_n(&there->pixels[at], __ATOMIC_RELAXED);
    return reader_.intact(*there) ? std::optional(pixel) : std::nullopt;
}

std::int64_t WatchTransport::tai_offset_ns() {
    const std::lock_guard lock(mutex_);
    return known_[newest_].info.tai_offset_ns;
}

Time WatchTransport::due(const Place& place) const noexcept {
    return {period_ns_.load(std::memory_order_relaxed) > 0 ? place.not_before_ns : 0};
}

void WatchTransport::work() {
    FrameRef held; // came too soon, and is the newest one
    Place place;   // its own
    while (!stopping_) {
        const std::uint32_t seen = wake_.value();
        if (unseen_wanted_.exchange(false, std::memory_order_acquire)) {
            if (const auto [frame, number] = take_unseen(); frame) {
                submitted_.fetch_add(1, std::memory_order_relaxed);
                copy(*frame, number);
            }
        }
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
    saturated_.note(frame, MonotonicClock().now());
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
        newest_ = serial % known_.size();
        known_[newest_] = {number, serial, frame.info};
        known_[newest_].info.transmit = nullptr;
        // Memory of the frame that was there before serves again.
        Details& details = details_[newest_];
        details.row_times.assign(frame.row_times().begin(), frame.row_times().end());
        if (const PixelTruth* const truth = frame.pixel_truth())
            details.mean_e.assign(truth->mean_e.begin(),
                                  truth->mean_e.begin() + static_cast<std::ptrdiff_t>(frame.pixels().size()));
    }
    changed_.notify_all();
}

} // namespace obscura::transports
