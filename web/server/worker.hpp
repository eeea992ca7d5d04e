// SPDX-License-Identifier: Apache-2.0
// Worker threads for answers that wait for a daemon or take long to encode.
#pragma once

#include "web/server/message.hpp"

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

namespace obscura::web {

/// Does the jobs of a lane in turns, a step of each, on a thread of the lane. What does not fit is refused at
/// once, so that a daemon that does not answer holds up no other one and takes no memory. Thread-safe.
class Worker {
public:
    /// Jobs of one queue of one lane that are in progress or wait.
    static constexpr std::size_t max_jobs = 4;
    /// Lanes at a time. One without jobs makes room for another.
    static constexpr std::size_t max_lanes = 16;
    using Done = std::function<void(Response)>;

    Worker() = default;
    /// Jobs that are not done are dropped, and `done` is not called.
    ~Worker();
    Worker(const Worker&) = delete;
    Worker& operator=(const Worker&) = delete;

    /// False: there are too many. `done` is called once, on a thread of the worker.
    bool take(Job job, Done done);

private:
    struct Item {
        Job job;
        Done done;
    };
    /// A thread and what it has to do.
    struct Lane {
        std::deque<Item> items;
        std::size_t in_queue[2] = {}; ///< with those in the thread's hands
        bool stop = false;
        std::thread thread;
    };
    void work(Lane& lane);
    /// Takes out a lane without jobs, whose thread ends; null: there is none. With mutex_ locked.
    [[nodiscard]] std::unique_ptr<Lane> take_idle();

    std::mutex mutex_; ///< of what follows
    std::condition_variable changed_;
    std::map<std::string, std::unique_ptr<Lane>> lanes_;
};

} // namespace obscura::web
