// SPDX-License-Identifier: Apache-2.0
// Copies of frames for programs that look at the camera: the newest ones, while somebody looks.
#include "core/clock.hpp"
#include "tests/support/catch.hpp"
#include "transports/watch/watch.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

using namespace obscura;
using namespace obscura::transports;
using namespace std::chrono_literals;

namespace {

constexpr std::int32_t width = 8, height = 6;

struct WatchBench {
    FramePool pool{8, width* height, height};
    WatchTransport watch{width * height, [] {}};
    std::atomic<bool> given_up{false};

    WatchBench() { watch.start(); }
    ~WatchBench() { watch.stop(); }

    /// A frame all of whose pixels are its id, with the first `rows` rows.
    FrameRef frame(std::uint64_t id, std::int32_t rows = 0) {
        const FrameRef frame = pool.acquire();
        REQUIRE(frame);
        frame->info.frame_id = id;
        frame->info.width = width, frame->info.height = height;
        frame->info.seen = MonotonicClock().now();
        std::fill(frame->pixels().begin(), frame->pixels().end(), static_cast<std::uint16_t>(id));
        frame->publish_rows(rows);
        return frame;
    }
    WatchTransport::Frames newest(std::uint64_t after, std::chrono::milliseconds wait = 60s) {
        return watch.newest(after, std::chrono::steady_clock::now() + wait, given_up);
    }
};

} // namespace

TEST_CASE("nothing is copied while nobody looks", "[transports]") {
    WatchBench bench;
    CHECK(bench.watch.submit(bench.frame(1, height)));
    CHECK(bench.watch.counters().submitted == 0);
    CHECK(bench.pool.in_use() == 0);
    CHECK_FALSE(bench.newest(0, 0ms));
    CHECK(bench.watch.submit(bench.frame(2, height)));
    const auto seen = bench.newest(0);
    REQUIRE(seen);
    CHECK(seen->info.frame_id == 2);
    CHECK(seen->number == 1);
    CHECK(seen->rows == height);
    CHECK(std::all_of(seen->pixels.begin(), seen->pixels.end(), [](std::uint16_t dn) { return dn == 2; }));
}

TEST_CASE("a reader waits for a newer frame, until its time or until it gives up", "[transports]") {
    WatchBench bench;
    CHECK_FALSE(bench.newest(0, 0ms));
    bench.watch.submit(bench.frame(1, height));
    const auto first = bench.newest(0);
    REQUIRE(first);
    CHECK(bench.newest(0) == first);
    CHECK_FALSE(bench.newest(first->number, 0ms));
    std::thread camera([&] {
        std::this_thread::sleep_for(20ms);
        bench.watch.submit(bench.frame(2, height));
    });
    const auto second = bench.newest(first->number);
    camera.join();
    REQUIRE(second);
    CHECK(second->info.frame_id == 2);
    bench.given_up = true;
    CHECK_FALSE(bench.newest(second->number));
}

TEST_CASE("frames that come while others wait are left out and counted", "[transports]") {
    WatchBench bench;
    CHECK_FALSE(bench.newest(0, 0ms));
    // The first one does not end, so that the thread waits for it.
    const FrameRef slow = bench.frame(1);
    CHECK(bench.watch.submit(slow));
    for (std::uint64_t id = 2; id <= 5; ++id)
        CHECK(bench.watch.submit(bench.frame(id, height))); // the camera never feels it
    CHECK(bench.watch.counters().dropped == 3);
    CHECK(bench.pool.in_use() == 2);
    slow->publish_rows(height);
    const auto second = bench.newest(1);
    REQUIRE(second);
    CHECK(second->info.frame_id == 2);
    bench.watch.submit(bench.frame(6, height));
    const auto sixth = bench.newest(second->number);
    REQUIRE(sixth);
    CHECK(sixth->info.frame_id == 6);
    CHECK(sixth->number - second->number - 1 == 3); // as its reader is told
}

TEST_CASE("rows that an abandoned frame does not have are 0", "[transports]") {
    WatchBench bench;
    CHECK_FALSE(bench.newest(0, 0ms));
    const FrameRef cut = bench.frame(7, 2);
    bench.watch.submit(cut);
    cut->abandon();
    const auto seen = bench.newest(0);
    REQUIRE(seen);
    CHECK(seen->rows == 2);
    CHECK(seen->pixels[2 * width - 1] == 7);
    CHECK(seen->pixels[2 * width] == 0);
    CHECK((seen->flags & frame_partial) != 0);
}

TEST_CASE("readers that keep their frames hold up nobody", "[transports]") {
    WatchBench bench;
    std::vector<WatchTransport::Frames> kept;
    CHECK_FALSE(bench.newest(0, 0ms));
    std::uint64_t id = 0;
    while (kept.size() < 4) { // as many as there are copies
        bench.watch.submit(bench.frame(++id, height));
        kept.push_back(bench.newest(kept.empty() ? 0 : kept.back()->number));
        REQUIRE(kept.back());
    }
    bench.watch.submit(bench.frame(++id, height));
    while (bench.pool.in_use() > 0)
        std::this_thread::yield();
    CHECK(bench.newest(0) == kept.back());
    CHECK(kept.front()->pixels[0] == 1);
    kept.clear();
    bench.watch.submit(bench.frame(++id, height));
    const auto next = bench.newest(4);
    REQUIRE(next);
    CHECK(next->info.frame_id == id);
}
