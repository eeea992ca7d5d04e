// SPDX-License-Identifier: Apache-2.0
// The file transport: order, bounded queue, partial frames, failures.
#include "core/error.hpp"
#include "core/realtime/log.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"
#include "transports/file/file_sink.hpp"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <functional>
#include <iterator>
#include <thread>

namespace file_sink_test {

using namespace obscura;
using namespace obscura::transports;

namespace {

FrameRef make_frame(FramePool& pool, std::uint64_t id) {
    FrameRef frame = pool.acquire();
    REQUIRE(frame);
    frame->info.frame_id = id;
    frame->info.width = 8, frame->info.height = 4;
    frame->info.bits_per_pixel = 12;
    return frame;
}

void fill(Frame& frame, std::int32_t rows) {
    for (std::int32_t y = 0; y < rows; ++y)
        std::ranges::fill(frame.row(y), static_cast<std::uint16_t>(frame.info.frame_id));
    frame.publish_rows(rows);
}

std::vector<std::uint16_t> words_of(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    std::vector<std::uint16_t> words(bytes.size() / 2);
    std::copy_n(bytes.data(), words.size() * 2, reinterpret_cast<char*>(words.data()));
    return words;
}

void wait_until(const std::function<bool()>& done) {
    for (int i = 0; i < 24'000 && !done(); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    CHECK(done());
}

} // namespace

TEST_CASE("every frame becomes a file, also when it is submitted before it is filled") {
    const test::TempFolder folder;
    FramePool pool(6, 32, 4);
    FileSink sink({.directory = folder.path(), .format = images::FrameFormat::raw, .queue_frames = 4});
    sink.start();
    for (std::uint64_t id = 1; id <= 4; ++id) {
        const FrameRef frame = make_frame(pool, id);
        REQUIRE(sink.submit(frame));
        fill(*frame, 2);
        std::this_thread::yield();
        fill(*frame, 4);
    }
    wait_until([&] { return sink.counters().delivered == 4; });
    // An acquisition that starts again at frame 1 overwrites nothing.
    const FrameRef again = make_frame(pool, 1);
    REQUIRE(sink.submit(again));
    fill(*again, 4);
    wait_until([&] { return sink.counters().delivered == 5; });
    sink.stop();
    CHECK(words_of(folder.path() / "frame_000003.raw") == std::vector<std::uint16_t>(32, 3));
    CHECK(std::filesystem::exists(folder.path() / "run2_frame_000001.raw"));
    CHECK(sink.counters().bytes == 5 * 64);
    CHECK(sink.counters().dropped == 0);
}

TEST_CASE("a full queue refuses frames and counts them; all references are given back") {
    const test::TempFolder folder;
    FramePool pool(6, 32, 4);
    FileSink sink({.directory = folder.path(), .format = images::FrameFormat::png, .queue_frames = 2});
    sink.start();
    std::vector<FrameRef> frames;
    int taken = 0;
    for (std::uint64_t id = 1; id <= 5; ++id) { // none is ever filled while it is submitted
        frames.push_back(make_frame(pool, id));
        taken += sink.submit(frames.back()) ? 1 : 0;
    }
    CHECK(taken == 2);
    CHECK(sink.counters().dropped == 3);
    for (FrameRef& frame : frames)
        frame->abandon();
    frames.clear();
    sink.stop();
    CHECK(sink.counters().submitted == 5);
    CHECK(sink.counters().dropped == 5); // abandoned without a single row
    CHECK(std::filesystem::is_empty(folder.path()));
    CHECK(pool.in_use() == 0);
}

TEST_CASE("a partial frame is written with the missing rows at 0, whatever the buffer held before") {
    const test::TempFolder folder;
    FramePool pool(1, 32, 4);
    FileSink sink({.directory = folder.path(), .format = images::FrameFormat::raw, .queue_frames = 2});
    sink.start();
    {
        const FrameRef frame = make_frame(pool, 1);
        fill(*frame, 4);
    }
    {
        const FrameRef frame = make_frame(pool, 2);
        REQUIRE(sink.submit(frame));
        fill(*frame, 3);
        frame->abandon();
    }
    wait_until([&] { return sink.counters().delivered == 1; });
    sink.stop();
    std::vector<std::uint16_t> expected(32, 2);
    std::fill(expected.begin() + 24, expected.end(), std::uint16_t{0});
    CHECK(words_of(folder.path() / "frame_000002.raw") == expected);
}

TEST_CASE("a folder that cannot be written stops the start; one that vanishes later is counted") {
    CHECK_THROWS_AS(FileSink({.directory = "/no/such/folder", .queue_frames = 2}).start(), OutputError);
    const test::TempFolder folder;
    std::filesystem::create_directory(folder.path() / "out");
    FramePool pool(2, 32, 4);
    FileSink sink(
        {.directory = folder.path() / "out", .format = images::FrameFormat::fits, .queue_frames = 2});
    sink.start();
    std::filesystem::remove(folder.path() / "out");
    set_log_level(LogLevel::error);
    for (std::uint64_t id = 1; id <= 2; ++id) {
        const FrameRef frame = make_frame(pool, id);
        REQUIRE(sink.submit(frame));
        fill(*frame, 4);
        wait_until([&] { return sink.counters().dropped == id; });
    }
    std::filesystem::create_directory(folder.path() / "out");
    const FrameRef frame = make_frame(pool, 3);
    REQUIRE(sink.submit(frame));
    fill(*frame, 4);
    wait_until([&] { return sink.counters().delivered == 1; });
    sink.stop();
    CHECK(std::filesystem::exists(folder.path() / "out" / "frame_000003.fits"));
}

} // namespace file_sink_test
