// SPDX-License-Identifier: Apache-2.0
// Thread for rare work: what it runs, refuses and gives back.
#include "emulator/control/idle_thread.hpp"
#include "service/failure.hpp"
#include "tests/support/catch.hpp"

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <stdexcept>
#include <thread>
#include <vector>

namespace idle_thread_test {

using namespace obscura::emulator;
using obscura::service::Failure;
using obscura::service::FailureCode;
using namespace std::chrono_literals;

namespace {

const std::atomic<bool> patient{false};

FailureCode refusal(IdleThread& thread, const IdleThread::Work& work,
                    const std::atomic<bool>& given_up = patient) {
    try {
        thread.run(work, given_up);
    } catch (const Failure& failure) {
        return failure.code;
    }
    FAIL("was not refused");
    return FailureCode::internal;
}

} // namespace

TEST_CASE("work runs on one thread, which ends with what it holds when nothing comes") {
    std::atomic<int> entered{0}, dropped{0};
    IdleThread thread([&] { ++entered; }, [&] { ++dropped; }, 20ms);
    CHECK_FALSE(thread.running());
    for (int round = 1; round <= 2; ++round) {
        std::thread::id where;
        thread.run([&](const auto&) { where = std::this_thread::get_id(); }, patient);
        CHECK(where != std::this_thread::get_id());
        while (thread.running())
            std::this_thread::sleep_for(1ms);
        CHECK(entered == round);
        CHECK(dropped == round);
    }
    CHECK_THROWS_AS(thread.run([](const auto&) { throw std::runtime_error("broken"); }, patient),
                    std::runtime_error);
}

TEST_CASE("who gives up does not wait for work in progress, which is told") {
    IdleThread thread([] {}, [] {}, 1h);
    std::atomic<bool> given_up{false};
    const auto told = std::make_shared<std::promise<bool>>();
    CHECK(refusal(
              thread,
              [&given_up, told](const std::atomic<bool>& cancel) {
                  given_up = true;
                  while (!cancel)
                      std::this_thread::sleep_for(1ms);
                  told->set_value(true);
              },
              given_up) == FailureCode::cancelled);
    CHECK(told->get_future().get());
    bool ran = false;
    thread.run([&](const auto&) { ran = true; }, patient);
    CHECK(ran);
}

TEST_CASE("a closed thread refuses, and its queue has an end") {
    std::optional<IdleThread> thread;
    thread.emplace([] {}, [] {}, 1h);
    std::promise<void> begun;
    std::atomic<int> refused{0}, closed{0};
    std::vector<std::thread> clients;
    const auto client = [&](const IdleThread::Work& work) {
        clients.emplace_back([&, work] {
            const FailureCode code = refusal(*thread, work);
            refused += code == FailureCode::busy ? 1 : 0;
            closed += code == FailureCode::not_now ? 1 : 0;
        });
    };
    // Work in progress may end well, or be refused.
    clients.emplace_back([&] {
        try {
            thread->run(
                [&begun](const std::atomic<bool>& cancel) {
                    begun.set_value();
                    while (!cancel)
                        std::this_thread::sleep_for(1ms);
                },
                patient);
        } catch (const Failure&) {
        }
    });
    begun.get_future().wait();
    for (std::size_t i = 0; i < IdleThread::max_waiting + 3; ++i)
        client([](const auto&) {});
    while (refused < 3)
        std::this_thread::sleep_for(1ms);
    thread->close();
    for (std::thread& one : clients)
        one.join();
    CHECK(closed == static_cast<int>(IdleThread::max_waiting));
    CHECK(refusal(*thread, [](const auto&) {}) == FailureCode::not_now);
    thread.reset();
}

} // namespace idle_thread_test
