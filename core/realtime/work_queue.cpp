// SPDX-License-Identifier: Apache-2.0
#include "core/realtime/work_queue.hpp"

#include <exception>
#include <future>
#include <utility>

namespace obscura {

struct WorkQueue::Task {
    const std::function<void()>* work = nullptr; ///< the caller's, which waits
    std::promise<bool> done{};                   ///< whether it has run
    Task* next = nullptr;                        ///< the one before it
};

WorkQueue::WorkQueue() : closed_(std::make_unique<Task>()), newest_(closed_.get()) {}

WorkQueue::~WorkQueue() {
    close();
}

void WorkQueue::open() noexcept {
    Task* expected = closed_.get();
    newest_.compare_exchange_strong(expected, nullptr);
}

void WorkQueue::close() {
    for (Task* task = take(closed_.get()); task != nullptr;) {
        const std::unique_ptr<Task> refused(std::exchange(task, task->next));
        refused->done.set_value(false);
    }
}

bool WorkQueue::run(const std::function<void()>& work, const std::function<void()>& wake) {
    auto task = std::make_unique<Task>();
    task->work = &work;
    std::future<bool> done = task->done.get_future();
    Task* newest = newest_.load();
    do {
        if (newest == closed_.get()) return false;
        task->next = newest;
    } while (!newest_.compare_exchange_weak(newest, task.get()));
    (void)task.release(); // the serving thread deletes it
    if (wake) wake();
    return done.get();
}

void WorkQueue::serve() {
    for (Task* task = take(nullptr); task != nullptr;) {
        const std::unique_ptr<Task> taken(std::exchange(task, task->next));
        try {
            (*taken->work)();
            taken->done.set_value(true);
        } catch (...) {
            taken->done.set_exception(std::current_exception());
        }
    }
}

WorkQueue::Task* WorkQueue::take(Task* instead) noexcept {
    Task* newest = newest_.load();
    do {
        if (newest == closed_.get()) return nullptr;
    } while (!newest_.compare_exchange_weak(newest, instead));
    Task* oldest = nullptr;
    while (newest != nullptr) {
        Task* const before = newest->next;
        newest->next = oldest;
        oldest = std::exchange(newest, before);
    }
    return oldest;
}

} // namespace obscura
