// SPDX-License-Identifier: Apache-2.0
// Records of outcomes: many writers, many waiting threads.
#include "core/clock.hpp"
#include "emulator/camera/frame_outcome.hpp"
#include "tests/support/catch.hpp"

#include <array>
#include <atomic>
#include <thread>
#include <vector>

namespace frame_outcome_test {

using namespace obscura;
using namespace obscura::emulator;

namespace {

Time soon() {
    return MonotonicClock().now() + 20 * ns_per_ms;
}

} // namespace

TEST_CASE("each of many waiting threads gets its own record from many writers") {
    OutcomeRing ring;
    constexpr std::uint32_t threads = 4, rounds = 200;
    std::array<std::uint32_t, threads> wrong{};
    std::vector<std::thread> running;
    for (std::uint32_t i = 0; i < threads; ++i)
        running.emplace_back([&ring, &wrong, i] {
            for (std::uint32_t n = 1; n <= rounds; ++n) {
                OutcomeRing::Request request = ring.request();
                std::thread writer([&ring, request, i, n] {
                    ring.publish({.frame_id = n,
                                  .request = request.number,
                                  .acquisition = i,
                                  .late_rows = n,
                                  .stalled_rows = i,
                                  .outcome = FrameOutcome::late});
                });
                const auto record = ring.wait(request, EventCount::never);
                writer.join();
                if (!record || record->request != request.number || record->frame_id != n ||
                    record->acquisition != i || record->late_rows != n || record->stalled_rows != i ||
                    record->outcome != FrameOutcome::late)
                    ++wrong[i];
            }
        });
    for (std::thread& thread : running)
        thread.join();
    CHECK(wrong == std::array<std::uint32_t, threads>{});
}

TEST_CASE("a record is found among others until so many newer ones have come") {
    OutcomeRing ring;
    OutcomeRing::Request early = ring.request(), found = early, lost = early;
    CHECK_FALSE(ring.wait(early, soon()));
    ring.publish({.frame_id = 3, .request = early.number, .outcome = FrameOutcome::complete});
    for (std::uint64_t i = 1; i < OutcomeRing::record_count; ++i)
        ring.publish({.frame_id = 3 + i});
    const auto record = ring.wait(found, soon());
    REQUIRE(record);
    CHECK(record->frame_id == 3);
    ring.publish({.frame_id = 9999});
    CHECK_FALSE(ring.wait(lost, soon()));
}

TEST_CASE("waiting threads can be woken without a record") {
    OutcomeRing ring;
    OutcomeRing::Request request = ring.request();
    std::atomic<bool> returned{false};
    std::thread waiting([&] {
        CHECK_FALSE(ring.wait(request, EventCount::never));
        returned = true;
    });
    while (!returned) {
        ring.wake_all();
        std::this_thread::yield();
    }
    waiting.join();
}

} // namespace frame_outcome_test
