// SPDX-License-Identifier: Apache-2.0
// Work that threads hand to one thread: each piece runs once, there, and a closed queue leaves no caller
// waiting.
#include "core/realtime/event_count.hpp"
#include "core/realtime/stack_thread.hpp"
#include "core/realtime/work_queue.hpp"
#include "tests/support/catch.hpp"

#include <pthread.h>

#include <atomic>
#include <stdexcept>
#include <thread>
#include <vector>

namespace work_queue_test {

using namespace obscura;

namespace {

/// A thread that serves a queue until it is told to stop.
class Serving {
public:
    explicit Serving(WorkQueue& queue) : queue_(queue) {
        queue_.open();
        thread_ = std::thread([this] {
            while (!stop_) {
                const std::uint32_t seen = news_.value();
                queue_.serve();
                if (!stop_) news_.wait(seen);
            }
        });
    }
    ~Serving() {
        stop_ = true;
        news_.notify();
        thread_.join();
        queue_.close();
    }
    Serving(const Serving&) = delete;
    Serving& operator=(const Serving&) = delete;

    [[nodiscard]] std::thread::id id() const { return thread_.get_id(); }
    void wake() { news_.notify(); }

private:
    WorkQueue& queue_;
    EventCount news_;
    std::atomic<bool> stop_{false};
    std::thread thread_;
};

} // namespace

TEST_CASE("work of many threads runs once each, on the serving thread") {
    WorkQueue queue;
    Serving serving(queue);
    constexpr int callers = 4, calls = 500;
    int sum = 0; // of the serving thread alone: no atomic
    std::atomic<int> elsewhere{0}, refused{0};
    std::vector<std::thread> threads;
    for (int i = 0; i < callers; ++i)
        threads.emplace_back([&] {
            for (int k = 0; k < calls; ++k)
                if (!queue.run(
                        [&] {
                            ++sum;
                            if (std::this_thread::get_id() != serving.id()) ++elsewhere;
                        },
                        [&] { serving.wake(); }))
                    ++refused;
        });
    for (std::thread& thread : threads)
        thread.join();
    CHECK(sum == callers * calls);
    CHECK(elsewhere == 0);
    CHECK(refused == 0);
}

TEST_CASE("what work throws comes back to its caller") {
    WorkQueue queue;
    Serving serving(queue);
    CHECK_THROWS_AS(queue.run([] { throw std::runtime_error("no"); }, [&] { serving.wake(); }),
                    std::runtime_error);
    CHECK(queue.run([] {}, [&] { serving.wake(); }));
}

TEST_CASE("a closed queue refuses work, also that which waits") {
    WorkQueue queue;
    bool ran = false;
    CHECK_FALSE(queue.run([&] { ran = true; }));
    queue.open();
    std::atomic<bool> waits{false};
    bool done = true;
    std::thread caller([&] { done = queue.run([&] { ran = true; }, [&] { waits = true; }); });
    while (!waits)
        std::this_thread::yield();
    queue.close();
    caller.join();
    CHECK_FALSE(done);
    CHECK_FALSE(queue.run([&] { ran = true; }));
    queue.serve();
    CHECK_FALSE(ran);
}

TEST_CASE("work is served in the order in which it came") {
    WorkQueue queue;
    queue.open();
    std::vector<int> order;
    std::vector<std::thread> callers;
    for (int i = 0; i < 3; ++i) {
        std::atomic<bool> waits{false};
        callers.emplace_back([&queue, &order, i, &waits] {
            const bool done = queue.run([&order, i] { order.push_back(i); }, [&waits] { waits = true; });
            if (!done) order.push_back(-1);
        });
        while (!waits)
            std::this_thread::yield();
    }
    queue.serve();
    for (std::thread& caller : callers)
        caller.join();
    CHECK(order == std::vector{0, 1, 2});
}

TEST_CASE("a thread has the stack that it was made with") {
    std::size_t bytes = 0;
    StackThread thread(512 << 10, [&bytes] {
        pthread_attr_t attributes;
        pthread_getattr_np(pthread_self(), &attributes);
        pthread_attr_getstacksize(&attributes, &bytes);
        pthread_attr_destroy(&attributes);
    });
    thread.join();
    CHECK(bytes == 512 << 10);
}

} // namespace work_queue_test
