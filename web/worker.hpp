// SPDX-License-Identifier: Apache-2.0
// Worker thread for answers that wait for a daemon or take long to encode.
#pragma once

#include "web/message.hpp"

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace obscura::web {

/// Does jobs in turns, a step of each. What does not fit is refused at once, so that a daemon that does not
/// answer holds up no other answer and takes no memory.
class Worker {
public:
    /// Jobs of one queue that are in progress or wait.
    static constexpr std::size_t most_jobs = 4;
    using Done = std::function<void(Response)>;

    Worker();
    /// Jobs that are not done are dropped, and `done` is not called.
    ~Worker();
    Worker(const Worker&) = delete;
    Worker& operator=(const Worker&) = delete;

    /// False: there are too many. `done` is called once, on the worker's thread. Thread-safe.
    bool take(Job job, Done done);

private:
    struct Item {
        Job job;
        Done done;
    };
    void work();

    std::mutex mutex_; ///< of what follows
    std::condition_variable changed_;
    std::deque<Item> items_;
    std::size_t in_queue_[2] = {}; ///< with those in the thread's hands
    bool stop_ = false;
    std::thread thread_; ///< last, so that all else is there when it starts
};

} // namespace obscura::web
