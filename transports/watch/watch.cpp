// SPDX-License-Identifier: Apache-2.0
#include "transports/watch/watch.hpp"

#include "core/clock.hpp"

#include <algorithm>
#include <utility>

namespace obscura::transports {
namespace {

/// The newest, one in the making, and those that readers have in hand; without a free one a frame is left
/// out.
constexpr std::size_t copies = 4;
/// A reader that comes back within this time finds the newest frame copied.
constexpr std::int64_t watched_ns = 2 * ns_per_s;
constexpr std::chrono::milliseconds look_period{50};

} // namespace

WatchTransport::WatchTransport(std::size_t most_pixels, std::function<void()> enter)
    : enter_(std::move(enter)), queue_(frames_held - 1), copies_(std::make_shared<Copies>()) {
    // Made at once and kept: memory that comes and goes disturbs the threads on other cores.
    for (std::size_t i = 0; i < copies; ++i) {
        copies_->all.push_back(std::make_unique<WatchedFrame>());
        copies_->all.back()->pixels.resize(most_pixels);
        copies_->free.push_back(copies_->all.back().get());
    }
}

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
    for (; queue_.front(); ++copied_)
        queue_.pop();
}

bool WatchTransport::submit(const FrameRef& frame) noexcept {
    if (frame->info.seen.ns > watched_until_.load(std::memory_order_relaxed)) return true;
    const std::uint64_t number = submitted_.fetch_add(1, std::memory_order_relaxed) + 1;
    // One more place than the queue has: that of the next frame is free.
    numbers_[queued_ % numbers_.size()] = number;
    if (queue_.push(frame)) {
        ++queued_;
        wake_.notify();
    } else {
        dropped_.fetch_add(1, std::memory_order_relaxed);
    }
    return true;
}

TransportCounters WatchTransport::counters() const noexcept {
    return {submitted_.load(), delivered_.load(), dropped_.load(), bytes_.load()};
}

WatchTransport::Frames WatchTransport::newest(std::uint64_t after,
                                              std::chrono::steady_clock::time_point until,
                                              const std::atomic<bool>& given_up) {
    const MonotonicClock clock;
    std::unique_lock lock(mutex_);
    if (clock.now().ns > watched_until_) newest_.reset(); // frames have gone by since
    while (true) {
        watched_until_ = clock.now().ns + watched_ns;
        if (newest_ && newest_->number > after) return newest_;
        const auto now = std::chrono::steady_clock::now();
        if (now >= until || given_up) return nullptr;
        changed_.wait_until(lock, std::min(until, now + look_period));
    }
}

void WatchTransport::work() {
    while (!stopping_) {
        const std::uint32_t seen = wake_.value();
        if (const FrameRef frame = queue_.front()) {
            frame->wait_rows(frame->info.height);
            copy(*frame, numbers_[copied_++ % numbers_.size()]);
            queue_.pop();
        } else if (!stopping_) {
            wake_.wait(seen);
        }
    }
}

void WatchTransport::copy(const Frame& frame, std::uint64_t number) {
    const std::span<const std::uint16_t> pixels = frame.pixels();
    const std::shared_ptr<WatchedFrame> copy = free_copy();
    if (!copy || pixels.size() > copy->pixels.size()) {
        dropped_.fetch_add(1, std::memory_order_relaxed);
        return;
    }
    delivered_.fetch_add(1, std::memory_order_relaxed);
    copy->number = number;
    copy->info = frame.info;
    copy->info.transmit = nullptr;
    copy->flags = frame.flags.load(std::memory_order_relaxed);
    copy->rows = frame.rows_ready();
    const std::size_t there =
        static_cast<std::size_t>(copy->rows) * static_cast<std::size_t>(frame.info.width);
    std::copy_n(pixels.begin(), there, copy->pixels.begin());
    std::fill(copy->pixels.begin() + static_cast<std::ptrdiff_t>(there),
              copy->pixels.begin() + static_cast<std::ptrdiff_t>(pixels.size()), std::uint16_t{0});
    bytes_.fetch_add(pixels.size_bytes(), std::memory_order_relaxed);
    Frames before = copy;
    {
        const std::lock_guard lock(mutex_);
        newest_.swap(before);
    }
    changed_.notify_all();
}

std::shared_ptr<WatchedFrame> WatchTransport::free_copy() {
    const std::lock_guard lock(copies_->mutex);
    if (copies_->free.empty()) return nullptr;
    WatchedFrame* const taken = copies_->free.back();
    copies_->free.pop_back();
    return {taken, [all = copies_](WatchedFrame* back) {
                const std::lock_guard again(all->mutex);
                all->free.push_back(back);
            }};
}

} // namespace obscura::transports
