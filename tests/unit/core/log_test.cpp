// SPDX-License-Identifier: Apache-2.0
#include "core/realtime/log.hpp"
#include "tests/support/catch.hpp"

#include <cerrno>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace log_test {

using namespace obscura;

TEST_CASE("a full log ring loses records, counts them and never blocks") {
    set_log_level(LogLevel::error); // keep the drained lines off the screen
    LogRing ring;
    int taken = 0;
    for (int i = 0; i < 1100; ++i)
        taken += ring.push({{i}, LogLevel::debug, "record {}", {i}}) ? 1 : 0;
    CHECK(taken == 1024);
    CHECK(ring.lost() == 76);
    CHECK(ring.drain() == 1024);
    CHECK(ring.push({}));
    CHECK(ring.drain() == 1);
    set_log_level(LogLevel::info);
}

TEST_CASE("several producers and one consumer lose nothing while there is room") {
    set_log_level(LogLevel::error);
    LogRing ring;
    std::vector<std::thread> producers;
    for (int t = 0; t < 3; ++t)
        producers.emplace_back([&] {
            for (int i = 0; i < 300; ++i)
                ring.push({{}, LogLevel::debug, "x", {}});
        });
    std::size_t drained = 0;
    while (drained < 900)
        drained += ring.drain();
    for (std::thread& producer : producers)
        producer.join();
    CHECK(drained == 900);
    CHECK(ring.lost() == 0);
    set_log_level(LogLevel::info);
}

TEST_CASE("an entry of the journal has fields, and no text makes fields or lines of its own") {
    const std::string program = program_invocation_short_name; // page and instrument log, too
    CHECK(journal_entry(LogLevel::warning, "v4l2: /dev/video10: is gone", "v4l2: DEVICE: WHY") ==
          "MESSAGE=v4l2: /dev/video10: is gone\nPRIORITY=4\nSYSLOG_IDENTIFIER=" + program +
              "\nOBSCURA_PART=v4l2\n"
              "MESSAGE_ID=" +
              message_id("v4l2: DEVICE: WHY") + "\n");
    const std::string hostile =
        journal_entry(LogLevel::error, "stimulator x\nPRIORITY=0\x1b[31m: away", "stimulator DEVICE: WHY");
    CHECK(hostile ==
          "MESSAGE=stimulator x PRIORITY=0\\x1B[31m: away\nPRIORITY=3\nSYSLOG_IDENTIFIER=" + program +
              "\n"
              "OBSCURA_PART=stimulator\nMESSAGE_ID=" +
              message_id("stimulator DEVICE: WHY") + "\n");
}

TEST_CASE("an entry of the journal has the numbers of camera and frame") {
    const auto fields = [](std::string_view text, std::string_view message) {
        const std::string entry = journal_entry(LogLevel::info, text, message);
        return entry.substr(entry.find("MESSAGE_ID=") + 44);
    };
    CHECK(fields("frame 812 dropped: 3", "frame {} dropped: {}") == "OBSCURA_FRAME=812\n");
    CHECK(fields("calls: camera 2: {\"Gain\":1} set although 10.0.0.1 controls it",
                 "calls: camera {}: {} set although {} controls it") == "OBSCURA_CAMERA=2\n");
    CHECK(fields("camera 1: frame 7", "camera {}: frame {}") == "OBSCURA_CAMERA=1\nOBSCURA_FRAME=7\n");
    // Not every message with the words has them, nor has every text the form of its message.
    CHECK(fields("no camera 5 here", "no camera 5 {}").empty());
    CHECK(fields("camera x: 5", "camera {}: {}").empty());
    CHECK(fields("another text", "camera {}").empty());
    CHECK(fields("", "camera {").empty());
}

TEST_CASE("a message's ID is FNV-1a of 128 bits, the same whatever its fields are formatted as") {
    // The first two of the vectors of http://www.isthe.com/chongo/tech/comp/fnv.
    CHECK(message_id("") == "6c62272e07bb014262b821756295c58d");
    CHECK(message_id("a") == "d228cb696f1a8caf78912b704e4a8964");
    CHECK(message_id("frame {} of {:.1f} s") == message_id("frame \u2026 of \u2026 s"));
    CHECK(message_id("frame {}") != message_id("frame {} "));
}

TEST_CASE("a flood of lines is cut off and counted") {
    LogLimit limit;
    std::uint64_t suppressed = 0;
    Time now{7 * ns_per_s};
    for (std::uint32_t i = 0; i < LogLimit::lines; ++i, now += ns_per_us) {
        REQUIRE(limit.admit(now, suppressed));
        CHECK(suppressed == 0);
    }
    for (int i = 0; i < 25; ++i)
        CHECK_FALSE(limit.admit(now, suppressed));
    now = Time{7 * ns_per_s + LogLimit::window_ns};
    CHECK(limit.admit(now, suppressed));
    CHECK(suppressed == 25);
    CHECK(limit.admit(now, suppressed));
    CHECK(suppressed == 0);
}

} // namespace log_test
