// SPDX-License-Identifier: Apache-2.0
// Copies of frames for programs that look at the camera: the newest ones, while somebody looks.
#include "core/clock.hpp"
#include "tests/support/catch.hpp"
#include "transports/watch/watch.hpp"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <optional>
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
    std::optional<WatchedFrame> newest(std::uint64_t after, std::chrono::milliseconds wait = 60s) {
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
    CHECK(bench.newest(0).value().number == first->number);
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

TEST_CASE("the last frame of a series is copied though it came too soon", "[transports]") {
    WatchBench bench;
    const auto released = [&bench] {
        while (bench.pool.in_use() > 0)
            std::this_thread::yield();
    };
    SECTION("after a period") {
        bench.watch.look(20 * ns_per_ms);
        bench.watch.submit(bench.frame(1, height));
        released();
        bench.watch.submit(bench.frame(2, height));
    }
    SECTION("at once, if somebody wants all frames") {
        bench.watch.look(3600 * ns_per_s);
        bench.watch.submit(bench.frame(1, height));
        released();
        bench.watch.submit(bench.frame(2, height));
        CHECK(bench.pool.in_use() == 1);
        bench.watch.look(0);
    }
    released();
    const auto last = bench.newest(0);
    REQUIRE(last);
    CHECK(last->info.frame_id == 2);
    CHECK(last->number == 2);
    CHECK(bench.watch.counters().submitted == 2);
}

TEST_CASE("frames are copied no faster than the fastest that looks has asked for", "[transports]") {
    WatchBench bench;
    const auto copied = [&bench](std::int64_t frames, std::int64_t spacing_ns) {
        const std::uint64_t before = bench.watch.counters().submitted;
        // Ahead of the clock, so that all are there before the last one's time comes.
        const Time begin = MonotonicClock().now() + 600 * ns_per_ms;
        for (std::int64_t i = 0; i < frames; ++i) {
            const FrameRef frame = bench.frame(1, height);
            frame->info.seen = begin + i * spacing_ns; // within the time for which somebody looks
            bench.watch.submit(frame);
            while (bench.watch.counters().delivered < bench.watch.counters().submitted)
                std::this_thread::yield();
        }
        const std::uint64_t count = bench.watch.counters().submitted - before;
        while (bench.pool.in_use() > 0)
            std::this_thread::yield();
        return count;
    };
    bench.watch.look(10 * ns_per_ms);
    CHECK(copied(20, 2 * ns_per_ms) == 4);
    bench.watch.look(4 * ns_per_ms); // another one
    bench.watch.look(10 * ns_per_ms);
    std::this_thread::sleep_for(50ms);
    CHECK(copied(20, 2 * ns_per_ms) == 10);
    const auto seen = bench.newest(38);
    REQUIRE(seen);
    CHECK(seen->number >= 39); // those that were left out are counted
}

TEST_CASE("a frame for programs of this process is that of the ring", "[transports]") {
    WatchBench bench;
    bench.watch.look(0);
    bench.watch.submit(bench.frame(5, height));
    const auto seen = bench.newest(0);
    REQUIRE(seen);
    const FrameRingReader reader(FileDescriptor(::dup(bench.watch.ring().descriptor())));
    const auto shared = reader.read();
    REQUIRE(shared);
    CHECK(shared->header.number == seen->number);
    CHECK(shared->header.frame_id == 5);
    CHECK(std::equal(shared->pixels.begin(), shared->pixels.end(), seen->pixels.begin(), seen->pixels.end()));
}
