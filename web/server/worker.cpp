// SPDX-License-Identifier: Apache-2.0
#include "web/server/worker.hpp"

#include <algorithm>
#include <optional>
#include <utility>

namespace obscura::web {

Worker::~Worker() {
    {
        const std::lock_guard lock(mutex_);
        for (const auto& [name, lane] : lanes_)
            lane->stop = true;
    }
    changed_.notify_all();
    for (const auto& [name, lane] : lanes_)
        lane->thread.join();
}

bool Worker::take(Job job, Done done) {
    std::unique_ptr<Lane> idle;
    {
        const std::lock_guard lock(mutex_);
        auto lane = lanes_.find(job.lane);
        if (lane == lanes_.end()) {
            if (lanes_.size() >= max_lanes && !(idle = take_idle())) return false;
            lane = lanes_.emplace(job.lane, std::make_unique<Lane>()).first;
            lane->second->thread = std::thread([this, own = lane->second.get()] { work(*own); });
        }
        std::size_t& jobs = lane->second->in_queue[static_cast<std::size_t>(job.queue)];
        if (jobs >= max_jobs) return false;
        ++jobs;
        lane->second->items.push_back({std::move(job), std::move(done)});
    }
    changed_.notify_all();
    if (idle) idle->thread.join();
    return true;
}

std::unique_ptr<Worker::Lane> Worker::take_idle() {
    const auto found = std::find_if(lanes_.begin(), lanes_.end(), [](const auto& lane) {
        return lane.second->in_queue[0] + lane.second->in_queue[1] == 0;
    });
    if (found == lanes_.end()) return nullptr;
    std::unique_ptr<Lane> lane = std::move(found->second);
    lanes_.erase(found);
    lane->stop = true;
    return lane;
}

void Worker::work(Lane& lane) {
    std::unique_lock lock(mutex_);
    while (true) {
        changed_.wait(lock, [&lane] { return lane.stop || !lane.items.empty(); });
        if (lane.stop) return;
        Item item = std::move(lane.items.front());
        lane.items.pop_front();
        lock.unlock();
        std::optional<Response> response = item.job.step();
        lock.lock();
        if (!response) {
            lane.items.push_back(std::move(item));
            continue;
        }
        --lane.in_queue[static_cast<std::size_t>(item.job.queue)];
        lock.unlock();
        item.done(*std::move(response));
        item = {}; // what a job holds ends outside the lock
        lock.lock();
    }
}

} // namespace obscura::web
