// SPDX-License-Identifier: Apache-2.0
// Lazily started SCHED_IDLE worker; exits and frees its state after an idle timeout.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

namespace obscura::emulator {

/// Starts at the first work. Its lock is shared with those who ask alone. Thread-safe.
class IdleThread {
public:
    /// Longest queue.
    static constexpr std::size_t max_waiting = 8;

    /// On the thread, `enter` is called first, and `drop` last, when no work has come for `unused`.
    IdleThread(std::function<void()> enter, std::function<void()> drop, std::chrono::milliseconds unused);
    /// Ends the work in progress by its `cancel`, and waits for that.
    ~IdleThread();
    IdleThread(const IdleThread&) = delete;
    IdleThread& operator=(const IdleThread&) = delete;

    /// Runs `work` on the thread and returns once it has run; rethrows what it throws. Once `given_up`
    /// becomes true, or after close(), throws service::Failure instead (cancelled, not-now); work that has
    /// begun is then told by its `cancel`, and must keep what it uses alive by itself. Throws
    /// service::Failure (busy) where too many wait.
    using Work = std::function<void(const std::atomic<bool>& cancel)>;
    void run(Work work, const std::atomic<bool>& given_up);
    /// Refuses work from now on, and that which waits. Does not wait for work in progress.
    void close();
    /// Whether there is a thread now.
    [[nodiscard]] bool running() const;

private:
    struct Job {
        Work work;
        std::atomic<bool> cancel{false};
        bool done = false; ///< with the mutex
        std::exception_ptr error{};
    };
    void start();
    void loop();

    const std::function<void()> enter_, drop_;
    const std::chrono::milliseconds unused_;
    mutable std::mutex mutex_; ///< of what follows
    std::condition_variable asked_, done_;
    std::deque<std::shared_ptr<Job>> waiting_;
    std::shared_ptr<Job> current_;
    bool running_ = false, closed_ = false;
    std::thread thread_;
};

} // namespace obscura::emulator
