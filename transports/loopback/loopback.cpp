// SPDX-License-Identifier: Apache-2.0
#include "transports/loopback/loopback.hpp"

#include "core/realtime/realtime.hpp"

#include <utility>

namespace obscura::transports {

LoopbackTransport::LoopbackTransport(LoopbackSettings settings)
    : settings_(std::move(settings)), queue_(settings_.queue_frames) {}

LoopbackTransport::~LoopbackTransport() {
    stop();
}

void LoopbackTransport::start() {
    {
        const std::lock_guard lock(mutex_);
        if (running_) return;
        running_ = true;
    }
    thread_ = std::thread([this] {
        name_this_thread("loopback");
        run();
    });
}

void LoopbackTransport::stop() {
    {
        const std::lock_guard lock(mutex_);
        running_ = false;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
}

bool LoopbackTransport::submit(const FrameRef& frame) noexcept {
    const std::lock_guard lock(mutex_);
    ++counters_.submitted;
    if (!running_ || queued_ == queue_.size()) {
        ++counters_.dropped;
        return false;
    }
    queue_[(head_ + queued_++) % queue_.size()] = frame;
    changed_.notify_one();
    return true;
}

TransportCounters LoopbackTransport::counters() const noexcept {
    const std::lock_guard lock(mutex_);
    return counters_;
}

std::vector<FrameRef> LoopbackTransport::kept() const {
    const std::lock_guard lock(mutex_);
    return {kept_.begin(), kept_.end()};
}

void LoopbackTransport::run() {
    std::unique_lock lock(mutex_);
    for (;;) {
        changed_.wait(lock, [this] { return queued_ > 0 || !running_; });
        if (queued_ == 0) return;
        const FrameRef frame = queue_[head_];
        lock.unlock();
        const bool complete = frame->wait_rows(frame->info.height) == frame->info.height;
        if (settings_.on_frame) settings_.on_frame(frame);
        lock.lock();
        queue_[head_] = FrameRef();
        head_ = (head_ + 1) % queue_.size();
        --queued_;
        if (complete) {
            ++counters_.delivered;
            counters_.bytes += frame->pixels().size_bytes();
        } else {
            ++counters_.dropped;
        }
        if (complete && settings_.keep_frames > 0) {
            kept_.push_back(frame);
            if (kept_.size() > settings_.keep_frames) kept_.pop_front();
        }
    }
}

} // namespace obscura::transports
