// SPDX-License-Identifier: Apache-2.0
// Queue of work that any thread hands to one other thread, and waits for.
#pragma once

#include <atomic>
#include <functional>
#include <memory>

namespace obscura {

/// Lock-free push: a caller that is not scheduled holds up neither other callers nor the serving thread,
/// which may have a higher priority. Closed at first. Thread-safe, not real-time safe.
class WorkQueue {
public:
    WorkQueue();
    /// Closes the queue; no thread may be in run() any more.
    ~WorkQueue();
    WorkQueue(const WorkQueue&) = delete;
    WorkQueue& operator=(const WorkQueue&) = delete;

    /// Takes work from now on.
    void open() noexcept;
    /// Refuses work from now on, and that which waits.
    void close();
    /// Hands `work` over, calls `wake`, which may be empty, and returns once it has run: true; false: the
    /// queue is closed. Rethrows what `work` throws. Not on the serving thread.
    bool run(const std::function<void()>& work, const std::function<void()>& wake = {});
    /// Serving thread: runs what waits, oldest first.
    void serve();

private:
    struct Task;

    /// Takes what waits, oldest first, and leaves `instead`.
    [[nodiscard]] Task* take(Task* instead) noexcept;

    const std::unique_ptr<Task> closed_; ///< the newest task of a closed queue
    std::atomic<Task*> newest_;
};

} // namespace obscura
