// SPDX-License-Identifier: Apache-2.0
#include "web/worker.hpp"

#include <optional>
#include <utility>

namespace obscura::web {

Worker::Worker() : thread_([this] { work(); }) {}

Worker::~Worker() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    changed_.notify_all();
    thread_.join();
}

bool Worker::take(Job job, Done done) {
    {
        const std::lock_guard lock(mutex_);
        std::size_t& jobs = in_queue_[static_cast<std::size_t>(job.queue)];
        if (jobs >= most_jobs) return false;
        ++jobs;
        items_.push_back({std::move(job), std::move(done)});
    }
    changed_.notify_all();
    return true;
}

void Worker::work() {
    std::unique_lock lock(mutex_);
    while (true) {
        changed_.wait(lock, [this] { return stop_ || !items_.empty(); });
        if (stop_) return;
        Item item = std::move(items_.front());
        items_.pop_front();
        lock.unlock();
        std::optional<Response> response = item.job.step();
        lock.lock();
        if (!response) {
            items_.push_back(std::move(item));
            continue;
        }
        --in_queue_[static_cast<std::size_t>(item.job.queue)];
        lock.unlock();
        item.done(*std::move(response));
        item = {}; // what a job holds ends outside the lock
        lock.lock();
    }
}

} // namespace obscura::web
