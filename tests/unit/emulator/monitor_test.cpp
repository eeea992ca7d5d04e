// SPDX-License-Identifier: Apache-2.0
// Monitor: paths of its socket, counters of the last minute, threads of the process.
#include "core/realtime/log.hpp"
#include "core/realtime/log_history.hpp"
#include "emulator/monitor/beat_times.hpp"
#include "emulator/monitor/isolation_advice.hpp"
#include "emulator/monitor/own_threads.hpp"
#include "emulator/monitor/recent_frames.hpp"
#include "host/monitor_client.hpp"
#include "host/monitor_paths.hpp"
#include "service/listener.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace monitor_test {

using namespace obscura;
using namespace obscura::emulator;
using Json = nlohmann::json;

TEST_CASE("sockets of daemons that have gone are removed, no others", "[emulator]") {
    const test::TempFolder folder;
    const auto touch = [&folder](const std::string& name) { std::ofstream(folder.path() / name) << ""; };
    const std::string own = fmt::format("obscurad-{}.socket", ::getpid());
    // Numbers of processes end at 2^22.
    const std::vector<std::string> kept{own,
                                        "obscurad-.socket",
                                        "obscurad-x1.socket",
                                        "obscurad-1x.socket",
                                        "obscurad-0.socket",
                                        "obscurad--5.socket",
                                        "other-99999999.socket"};
    for (const std::string& name : kept)
        touch(name);
    touch("obscurad-99999999.socket");
    touch("obscurad-99999999.calls");
    host::remove_left_over_sockets(folder.path());
    for (const std::string& name : kept)
        CHECK(std::filesystem::exists(folder.path() / name));
    CHECK_FALSE(std::filesystem::exists(folder.path() / "obscurad-99999999.socket"));
    CHECK_FALSE(std::filesystem::exists(folder.path() / "obscurad-99999999.calls"));
}

TEST_CASE("a daemon's own monitor socket is found again", "[emulator]") {
    const test::TempFolder folder;
    ::unsetenv("RUNTIME_DIRECTORY");
    ::setenv("XDG_RUNTIME_DIR", folder.path().c_str(), 1);
    CHECK(host::own_monitor_folder() == folder.path() / "obscura");
    const std::filesystem::path path = host::own_monitor_socket();
    std::filesystem::create_directories(path.parent_path());
    CHECK_FALSE(host::refusal_of_socket(path).empty());
    const auto listener = service::Listener::unix_socket(path);
    CHECK(host::refusal_of_socket(path).empty());
    CHECK(host::own_calls_socket() ==
          folder.path() / "obscura" / fmt::format("obscurad-{}.calls", ::getpid()));
    { const std::ofstream calls(host::own_calls_socket()); }
    const auto found = host::monitor_sockets();
    CHECK(std::find(found.begin(), found.end(), host::own_calls_socket()) == found.end());
    CHECK(std::find(found.begin(), found.end(), path) != found.end());
    ::setenv("RUNTIME_DIRECTORY", "/run/obscura-left:/run/other", 1);
    CHECK(host::own_monitor_folder() == "/run/obscura-left");
    CHECK(host::own_calls_socket() == "/run/obscura-left/calls");
    ::unsetenv("RUNTIME_DIRECTORY");
}

TEST_CASE("the last minute is counted from snapshots a second apart", "[emulator]") {
    RecentFrames recent;
    CameraCounters counters;
    const auto at = [](double s) { return Time{static_cast<std::int64_t>(s * 1e9)}; };
    CHECK(recent.until(at(0), counters).seconds == 0);
    // 10 frames a second for 200 s, looked at ten times a second; from 150 s on every tenth is late.
    for (int i = 0; i <= 2000; ++i) {
        counters.triggers = counters.frames = counters.complete = static_cast<std::uint64_t>(i);
        if (i > 1500 && i % 10 == 0) {
            ++counters.late;
            counters.late_rows += 7;
        }
        recent.note(at(0.1 * i), counters, true);
    }
    const FrameOutcomes last = recent.until(at(200), counters);
    CHECK(last.seconds >= 60);
    CHECK(last.seconds <= 61.1);
    CHECK(last.frames == static_cast<std::uint64_t>(std::lround(10 * last.seconds)));
    CHECK(last.late == 50);
    CHECK(last.late_rows == 350);
    // Later, without further frames, they move out of the minute.
    for (int i = 0; i < 130; ++i)
        recent.note(at(200 + 0.5 * i), counters, true);
    CHECK(recent.until(at(265), counters).frames == 0);
}

TEST_CASE("a frame is overdue after three times the longest gap of the last minute", "[emulator]") {
    RecentFrames recent;
    CameraCounters counters;
    int looks = 0; // ten a second
    const auto now = [&looks] { return Time{looks * ns_per_s / 10}; };
    /// A frame after each of so many looks.
    const auto frames = [&](int count, int period) {
        for (int i = 1; i <= count * period; ++i) {
            if (i % period == 0) ++counters.complete;
            ++looks;
            recent.note(now(), counters, true);
        }
    };
    const auto overdue_s = [&] { return recent.last_frame(now()) ? recent.last_frame(now())->overdue_s : 0; };
    frames(1, 5);
    CHECK_FALSE(recent.last_frame(now())); // one has no gap
    frames(100, 1);
    CHECK(overdue_s() == 2);
    CHECK(recent.last_frame(now())->age_s == 0);
    frames(1, 40);
    CHECK(overdue_s() == 12);
    frames(500, 1);
    CHECK(overdue_s() == 12); // for a minute
    frames(200, 1);
    CHECK(overdue_s() == 2);
    looks += 1000; // no frame, however long: what there was before holds
    recent.note(now(), counters, true);
    CHECK(recent.last_frame(now())->age_s == 100);
    CHECK(overdue_s() == 2);
    recent.note(now(), counters, false);
    CHECK_FALSE(recent.last_frame(now()));
    frames(1, 5);
    CHECK_FALSE(recent.last_frame(now())); // of another acquisition
}

TEST_CASE("the verdict names the first thing that is wrong", "[emulator]") {
    FrameOutcomes o;
    o.seconds = 60;
    const AwaitedTrigger line{.name = "Line0 (gpio)", .acquires_s = 300};
    CHECK(judge(o, false, "", line, false).text ==
          "idle: the acquisition is stopped, no client is in control");
    CHECK(judge(o, false, "10.0.0.1:7", line, false).text == "idle: 10.0.0.1:7 has not started it");
    CHECK(judge(o, false, "", line, false).health == Health::idle);
    CHECK(judge(o, true, "", line, false).text == "no trigger of Line0 (gpio), last 60 s");
    CHECK(judge(o, true, "", line, false).health == Health::bad);
    o.triggers = o.frames = o.complete = 600;
    CHECK(judge(o, true, "", line, false).text == "on time: 0 late rows in 600 frames, last 60 s");
    CHECK(judge(o, true, "", line, false).health == Health::good);
    o.degraded = 4;
    CHECK(judge(o, true, "", line, false).text ==
          "on time: 0 late rows in 600 frames, 4 degraded, last 60 s");
    o.late = 2;
    o.late_rows = 30;
    CHECK(judge(o, true, "", line, false).text == "30 late rows in 2 of 600 frames, last 60 s");
    o.abandoned = 3;
    CHECK(judge(o, true, "", line, false).text == "3 of 600 frames abandoned, last 60 s");
    FrameOutcomes full_disk = o;
    full_disk.undelivered = 76;
    full_disk.undelivered_by = "file";
    CHECK(judge(full_disk, true, "", line, false).text ==
          "76 of 600 frames were not delivered by file, see the log, last 60 s");
    CHECK(judge(full_disk, true, "", line, false).health == Health::bad);
    o.unsent = 4;
    CHECK(judge(o, true, "", line, false).text ==
          "4 of 600 frames were sent nowhere: no transport had a receiver, or room, last 60 s");
    CHECK(judge(o, true, "", line, false).health == Health::bad);
    CHECK(judge(o, true, "10.0.0.1:7", line, true).text == judge(o, true, "", line, false).text);
    CHECK(judge(o, true, "", line, true).text == "3 of 600 frames abandoned, last 60 s");
    const FrameOutcomes waiting{
        .seconds = 60, .triggers = 600, .frames = 600, .complete = 600, .unsent = 600};
    CHECK(judge(waiting, true, "", line, true).text ==
          "on time: 0 late rows in 600 frames, 600 sent nowhere as no client is in control, last 60 s");
    CHECK(judge(waiting, true, "", line, true).health == Health::good);
    o.dropped = 5;
    CHECK(judge(o, true, "", line, false).text ==
          "5 of 600 triggers without a frame: no memory or transport was free, last 60 s");
    const RecentFrames::LastFrame late{.age_s = 7.2, .overdue_s = 6}, young{.age_s = 5.9, .overdue_s = 6};
    CHECK(judge(o, true, "", line, false, late).text ==
          "no frame of Line0 (gpio) for 7 s, where one was due within 6 s");
    CHECK(judge(o, true, "", line, false, late).health == Health::bad);
    CHECK(judge(o, true, "", line, false, young).text == judge(o, true, "", line, false).text);
    CHECK(judge(o, true, "", {.name = "Software", .on_request = true}, false, late).text ==
          judge(o, true, "", line, false).text);
    o.missed_triggers = 1;
    o.missed_because[static_cast<std::size_t>(MissedReason::rendering)] = 1;
    CHECK(judge(o, true, "", line, false).text == "1 of 600 triggers missed (rendering: 1), last 60 s");
    CHECK(judge(o, true, "", line, false).health == Health::bad);
}

TEST_CASE("a camera that waits for what only comes on request is idle", "[emulator]") {
    FrameOutcomes o;
    o.seconds = 60;
    AwaitedTrigger awaited{.name = "Software", .on_request = true, .acquires_s = 300};
    CHECK(judge(o, true, "", awaited, false).text == "idle: waits for Software, none in the last 60 s");
    CHECK(judge(o, true, "", awaited, false).health == Health::idle);
    awaited = {.name = "Line0 (timer)", .acquires_s = 4};
    CHECK(judge(o, true, "", awaited, false).text ==
          "idle: no trigger yet of Line0 (timer), 4 s after the start of the acquisition");
    awaited.acquires_s = 11;
    CHECK(judge(o, true, "", awaited, false).health == Health::bad);
    o.triggers = o.missed_triggers = 1;
    awaited.on_request = true;
    CHECK(judge(o, true, "", awaited, false).health == Health::bad);
}

TEST_CASE("threads are read as the kernel schedules them", "[emulator]") {
    const test::TempFolder folder;
    // Fields 3 to 41 of proc(5); name with a parenthesis, FIFO at 80, 150 + 50 clock ticks.
    std::filesystem::create_directory(folder.path() / "7");
    std::ofstream(folder.path() / "7" / "stat") << "7 (trig) ger) S 1 2 3 4 5 6 7 8 9 10 150 50 13 14 -81 "
                                                   "-10 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31 32 "
                                                   "33 34 35 36 80 1 39\n";
    std::ofstream(folder.path() / "7" / "status")
        << "Name:\ttrig) ger\nCpus_allowed:\t27\nCpus_allowed_list:\t0-2,5\n";
    std::filesystem::create_directory(folder.path() / "8"); // ended meanwhile
    const auto threads = own_threads(folder.path());
    REQUIRE(threads.size() == 1);
    CHECK(threads[0].name == "trig) ger");
    CHECK(threads[0].policy == "fifo");
    CHECK(threads[0].priority == 80);
    CHECK(threads[0].nice == -10);
    CHECK(threads[0].cpu_s == 200.0 / static_cast<double>(::sysconf(_SC_CLK_TCK)));
    CHECK(threads[0].processor == 36);
    CHECK(threads[0].cores == "0-2,5");
    CHECK_FALSE(own_threads().empty());
}

TEST_CASE("a machine is told what would bring its rows out in time") {
    MachineFacts facts;
    facts.highest_priority = 80;
    facts.memory_locked = facts.realtime_kernel = true;
    facts.release_cores = facts.isolated = *parse_cores("3");
    facts.governor = "performance";
    CHECK(isolation_advice(facts).empty());
    facts.isolated = *parse_cores("2");
    REQUIRE(isolation_advice(facts).size() == 1);
    CHECK_THAT(isolation_advice(facts)[0],
               Catch::Matchers::ContainsSubstring("isolcpus=domain,managed_irq,3 "));
    CHECK(isolation_advice({}).size() == 3); // no priority, no core, no real-time kernel

    const test::TempFolder root;
    const auto file = [&root](const char* path, const char* text) {
        std::filesystem::create_directories((root.path() / path).parent_path());
        std::ofstream(root.path() / path) << text;
    };
    file("proc/self/status", "Name:\tobscurad\nVmLck:\t    4096 kB\n");
    file("proc/cpuinfo", "processor\t: 0\nflags\t\t: fpu hypervisor lahf_lm\n");
    file("sys/kernel/realtime", "1\n");
    file("sys/devices/system/cpu/isolated", "3,5-6\n");
    file("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "powersave\n");
    const MachineFacts read = machine_facts({}, 80, root.path());
    CHECK(read.memory_locked);
    CHECK(read.virtual_machine);
    CHECK(read.realtime_kernel);
    CHECK(cores_text(read.isolated) == "3,5-6");
    CHECK(read.governor == "powersave");
    std::filesystem::remove_all(root.path() / "proc");
    CHECK_FALSE(machine_facts({}, 80, root.path()).memory_locked);
}

TEST_CASE("the log's lines are kept with numbers that go on", "[core]") {
    const auto all = log_history().after(0, LogHistory::lines);
    const std::uint64_t before = all.empty() ? 0 : all.back().id;
    log_warning("one");
    CHECK(log_history().after(before, 1)[0].message == message_id("one"));
    log_notice("two");
    const auto lines = log_history().after(before, 10);
    REQUIRE(lines.size() == 2);
    CHECK(lines[0].id == before + 1);
    CHECK(lines[0].text == "one");
    CHECK(lines[0].level == LogLevel::warning);
    CHECK(log_history().after(before, 1).size() == 1);
    CHECK(log_history().after(before + 2, 10).empty());
}

TEST_CASE("the oldest lines of the log make room, and long ones are cut", "[core]") {
    const auto history = std::make_unique<LogHistory>();
    CHECK(history->after(0, 10).empty());
    const std::size_t count = 3 * LogHistory::lines + 5;
    for (std::size_t i = 1; i <= count; ++i)
        history->add(LogLevel::info, fmt::format("line {}", i), static_cast<std::int64_t>(i));
    const auto kept = history->after(0, 2 * LogHistory::lines);
    REQUIRE(kept.size() == LogHistory::lines);
    CHECK(kept.front().id == count - LogHistory::lines + 1);
    for (std::size_t i = 0; i < kept.size(); ++i) {
        REQUIRE(kept[i].id == kept.front().id + i);
        REQUIRE(kept[i].text == fmt::format("line {}", kept[i].id));
        REQUIRE(kept[i].utc_ns == static_cast<std::int64_t>(kept[i].id));
    }
    CHECK(history->after(count, 10).empty());
    CHECK(history->after(UINT64_MAX, 10).empty());
    history->add(LogLevel::error, std::string(3000, 'x'), 0);
    CHECK(history->after(count, 10).at(0).text == std::string(LogHistory::text_bytes, 'x'));
}

TEST_CASE("the age of a heartbeat is the time since the look that saw it", "[emulator]") {
    Heartbeat first("first"), second("second");
    BeatTimes beats;
    CHECK(beats.ages(Time{}).empty());
    first.beat();
    second.beat();
    beats.note(Time{10 * ns_per_s}, {&first, &second});
    first.beat();
    beats.note(Time{11 * ns_per_s}, {&first, &second});
    second.rest();
    const std::vector<BeatTimes::Age> ages = beats.ages(Time{13 * ns_per_s});
    REQUIRE(ages.size() == 2);
    CHECK((ages[0].name == "first" && ages[0].age_s == 2 && !ages[0].silent));
    CHECK((ages[1].name == "second" && ages[1].age_s == 3 && ages[1].silent));
    beats.note(Time{14 * ns_per_s}, {&second}); // the source of triggers was replaced
    CHECK(beats.ages(Time{14 * ns_per_s}).size() == 1);
}

} // namespace monitor_test
