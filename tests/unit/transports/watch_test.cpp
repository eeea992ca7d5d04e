// SPDX-License-Identifier: Apache-2.0
// Copies of frames for programs that look at the camera: the newest ones, while there are viewers.
#include "core/clock.hpp"
#include "tests/support/catch.hpp"
#include "transports/watch/watch.hpp"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <optional>
#include <thread>
#include <vector>

namespace watch_test {

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

TEST_CASE("nothing is copied without a client, and the last frame is there for the first one",
          "[transports]") {
    WatchBench bench;
    CHECK_FALSE(bench.newest(0, 0ms));
    WatchBench unseen;
    for (std::uint64_t id = 1; id <= 5; ++id)
        CHECK(unseen.watch.submit(unseen.frame(id, height)));
    CHECK(unseen.watch.counters().submitted == 0);
    CHECK(unseen.pool.in_use() == 1); // none but the last
    const auto seen = unseen.newest(0);
    REQUIRE(seen);
    CHECK(seen->info.frame_id == 5);
    CHECK(seen->number == 5);
    CHECK(seen->rows == height);
    CHECK(std::all_of(seen->pixels.begin(), seen->pixels.end(), [](std::uint16_t dn) { return dn == 5; }));
    for (int i = 0; i < 1000 && unseen.pool.in_use() > 0; ++i) // given back by the thread that copied it
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    CHECK(unseen.pool.in_use() == 0);
    // It stays, however often it is asked for, and by its id.
    CHECK(unseen.newest(0)->number == 5);
    CHECK(unseen.watch.kept(5, std::chrono::steady_clock::now(), unseen.given_up));
    CHECK(unseen.watch.submit(unseen.frame(6, height)));
    CHECK(unseen.newest(5)->info.frame_id == 6);
}

TEST_CASE("frames of a pipeline and one who looks now and then never mix", "[transports]") {
    WatchBench bench;
    std::atomic<bool> end{false};
    std::thread pipeline([&] {
        for (std::uint64_t id = 1; !end; ++id)
            if (const FrameRef frame = bench.frame(id % 1000, height)) bench.watch.submit(frame);
    });
    int good = 0; // assertions are not for two threads
    for (int i = 0; i < 200; ++i) {
        const auto seen = bench.newest(0);
        const auto dn = static_cast<std::uint16_t>(seen ? seen->info.frame_id : 0);
        good += seen && std::all_of(seen->pixels.begin(), seen->pixels.end(),
                                    [dn](std::uint16_t v) { return v == dn; });
    }
    end = true;
    pipeline.join();
    CHECK(good == 200);
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
            frame->info.seen = begin + i * spacing_ns; // within the time for which there are viewers
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

TEST_CASE("saturated pixels are counted while somebody asks", "[transports]") {
    WatchBench bench;
    const auto watched = [&](std::uint64_t id, std::uint16_t dn, std::size_t pixels, std::int32_t rows) {
        const FrameRef frame = bench.frame(id);
        frame->info.bits_per_pixel = 12;
        frame->info.trigger_edge = Time{static_cast<std::int64_t>(1000 + id)};
        std::fill_n(frame->pixels().begin(), pixels, dn);
        frame->publish_rows(rows);
        if (rows < height) frame->abandon();
        REQUIRE(bench.watch.submit(frame));
        REQUIRE(bench.newest(id - 1)->info.frame_id == id);
    };
    CHECK_FALSE(bench.newest(0, 0ms)); // looks, and does not count
    watched(1, 4095, 5, height);
    CHECK_FALSE(bench.watch.saturated().of(1, Time{1001}));
    bench.watch.count_saturated();
    watched(2, 4095, 5, height);
    watched(3, 4094, 5, height);
    watched(4, 65535, 20, 2); // of two rows
    CHECK(bench.watch.saturated().of(2, Time{1002}) == 5);
    CHECK(bench.watch.saturated().of(3, Time{1003}) == 0);
    CHECK(bench.watch.saturated().of(4, Time{1004}) == 2 * width);
    CHECK_FALSE(bench.watch.saturated().of(2, Time{2002})); // of another acquisition
    SaturationCounts counts;
    counts.want(Time{5});
    CHECK((counts.wanted(Time{5}) && !counts.wanted(Time{6})));
}

TEST_CASE("the latest frames are there by their numbers", "[transports]") {
    WatchBench bench;
    CHECK_FALSE(bench.newest(0, 0ms));
    CHECK_FALSE(bench.watch.numbered(1));
    for (std::uint64_t id = 1; id <= 6; ++id) {
        bench.watch.submit(bench.frame(id + 10, height));
        REQUIRE(bench.newest(id - 1)->number == id);
    }
    for (std::uint64_t number = 3; number <= 6; ++number) {
        const auto frame = bench.watch.numbered(number);
        REQUIRE(frame);
        CHECK(frame->number == number);
        CHECK(frame->info.frame_id == number + 10);
        CHECK(frame->rows == height);
        CHECK(frame->pixels.at(7) == number + 10);
    }
    for (const std::uint64_t number : {0, 1, 2, 7})
        CHECK_FALSE(bench.watch.numbered(number));
}

TEST_CASE("what a probe needs is kept of the latest frames, by their ids", "[transports]") {
    FramePool pool(6, width * height, height, {.pixels = true});
    WatchBench bench;
    const auto kept = [&](std::uint64_t id) {
        return bench.watch.kept(id, std::chrono::steady_clock::now() + (id == 0 ? 60s : 0s), bench.given_up);
    };
    CHECK_FALSE(kept(3));
    std::uint64_t number = 0;
    const auto copied = [&](std::uint64_t id) {
        const FrameRef frame = pool.acquire();
        REQUIRE(frame);
        frame->info.frame_id = id;
        frame->info.width = width, frame->info.height = height;
        frame->info.seen = MonotonicClock().now();
        for (std::int32_t y = 0; y < height; ++y)
            frame->row_times()[static_cast<std::size_t>(y)] = {Time{y}, Time{y + static_cast<int>(id)}};
        for (std::size_t i = 0; i < frame->pixels().size(); ++i) {
            frame->pixels()[i] = static_cast<std::uint16_t>(100 * id + i);
            frame->pixel_truth()->mean_e[i] = static_cast<float>(1000 * id + i);
        }
        frame->publish_rows(height);
        bench.watch.submit(frame);
        number = bench.newest(number).value().number;
    };
    CHECK_FALSE(bench.newest(0, 0ms)); // looks
    for (std::uint64_t id = 1; id <= 3; ++id)
        copied(id);
    const auto second = kept(2);
    REQUIRE(second);
    CHECK(second->info.frame_id == 2);
    CHECK(second->rows == height);
    CHECK(second->row_times == std::vector<RowTime>{{Time{0}, Time{2}},
                                                    {Time{1}, Time{3}},
                                                    {Time{2}, Time{4}},
                                                    {Time{3}, Time{5}},
                                                    {Time{4}, Time{6}},
                                                    {Time{5}, Time{7}}});
    const auto pixel = bench.watch.pixel(*second, 3, 2);
    REQUIRE(pixel);
    CHECK(pixel->dn == 200 + 2 * width + 3);
    CHECK(pixel->mean_e == 2000 + 2 * width + 3);
    CHECK(kept(0).value().info.frame_id == 3);
    CHECK(kept(9).value().info.frame_id == 3); // is not there
    copied(2);                                 // of the next acquisition
    CHECK(kept(2).value().serial == second->serial + 2);
    copied(3);
    copied(4);
    CHECK_FALSE(bench.watch.pixel(*second, 3, 2)); // overwritten
    CHECK_FALSE(bench.watch.kept(5, {}, bench.given_up).value().info.frame_id == 5);
}

} // namespace watch_test
