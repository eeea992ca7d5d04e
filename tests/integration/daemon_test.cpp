// SPDX-License-Identifier: Apache-2.0
// The daemon from outside: start, service manager, signals, and what it says when something is wrong.
#include "tests/integration/daemon_bench.hpp"
#include "tests/support/catch.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <nlohmann/json.hpp>
#include <sched.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

using namespace obscura::test;
using namespace std::chrono_literals;
using Catch::Matchers::ContainsSubstring;

namespace {

using Json = nlohmann::json;

// The other end of NOTIFY_SOCKET, under an abstract name.
class ServiceManager {
public:
    ServiceManager() {
        name_ = "obscura-test-" + std::to_string(getpid()) + "-" + std::to_string(++made);
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        std::memcpy(address.sun_path + 1, name_.data(), name_.size());
        fd_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
        const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name_.size());
        REQUIRE(bind(fd_, reinterpret_cast<sockaddr*>(&address), size) == 0);
        const timeval limit{20, 0};
        setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    }
    ~ServiceManager() { close(fd_); }
    [[nodiscard]] std::string environment() const { return "NOTIFY_SOCKET=@" + name_; }
    std::string next() const {
        char text[256];
        const ssize_t n = recv(fd_, text, sizeof text, 0);
        return n > 0 ? std::string(text, static_cast<std::size_t>(n)) : std::string();
    }

private:
    static inline int made = 0;
    std::string name_;
    int fd_ = -1;
};

} // namespace

TEST_CASE("frames go to files without any client, and SIGTERM ends the daemon") {
    const TempFolder folder;
    DaemonOptions options;
    options.size = 128;
    options.rate_hz = 20;
    options.frames_folder = (folder.path() / "frames").string();
    DaemonProcess daemon(folder, write_configuration(folder, options));
    REQUIRE(daemon.wait_ready());
    CHECK(daemon.ready_text() == "ready none\n");
    CHECK(daemon.process().out() == "ready none\n");
    wait_for_file(folder.path() / "frames" / "frame_000010.raw");

    daemon.process().send(SIGTERM);
    CHECK(daemon.process().wait(120s) == 0);
    CHECK_THAT(daemon.process().err(), ContainsSubstring("SIGTERM: stopping"));

    const Json json = Json::parse(daemon.statistics());
    const Json& camera = json["camera"];
    CHECK(camera["frames"] >= 10);
    CHECK(camera["triggers"] ==
          camera["frames"].get<int>() + camera["missed_triggers"].get<int>() + camera["dropped"].get<int>());
    CHECK(json["latency_us"]["trigger_to_first_row"]["p50"] >= 5000);
    const int delivered = json["transports"]["file"]["delivered"];
    CHECK(delivered >= 10);
    CHECK_THAT(daemon.process().err(), ContainsSubstring(std::to_string(delivered) + " delivered"));
}

TEST_CASE("the service manager hears READY, the watchdog's beats and STOPPING") {
    const TempFolder folder;
    const ServiceManager manager;
    DaemonOptions options;
    options.size = 64;
    DaemonProcess daemon(folder, write_configuration(folder, options),
                         {manager.environment(), "WATCHDOG_USEC=600000"});
    CHECK(manager.next() == "READY=1");
    CHECK(manager.next() == "WATCHDOG=1");
    CHECK(manager.next() == "WATCHDOG=1");
    daemon.process().send(SIGINT);
    std::string last;
    while ((last = manager.next()) == "WATCHDOG=1") {
    }
    CHECK(last == "STOPPING=1");
    CHECK(daemon.process().wait(120s) == 0);
}

TEST_CASE("questions are answered without starting anything") {
    const TempFolder folder;
    DaemonOptions options;
    options.size = 64;
    options.frames_folder = (folder.path() / "frames").string();
    const std::string config = write_configuration(folder, options).string();
    const std::string program = OBSCURA_BINARY_DIR "/emulator/obscurad";

    ChildProcess check(folder.path(), "check", {program, "--config", config, "--check"});
    CHECK(check.wait(120s) == 0);
    CHECK(check.out() == config + ": good\n");
    ChildProcess print(folder.path(), "print", {program, "--config", config, "--print-config"});
    CHECK(print.wait(120s) == 0);
    CHECK_THAT(print.out(), ContainsSubstring("pool_frames = 16"));
    ChildProcess version(folder.path(), "version", {program, "--version"});
    CHECK(version.wait(120s) == 0);
    CHECK_THAT(version.out(), ContainsSubstring("obscurad 0."));
    ChildProcess help(folder.path(), "help", {program, "--help"});
    CHECK(help.wait(120s) == 0);
    CHECK_THAT(help.out(), ContainsSubstring("--ready-file"));
    CHECK_FALSE(std::filesystem::exists(folder.path() / "frames"));

    ChildProcess nothing(folder.path(), "nothing", {program});
    CHECK(nothing.wait(120s) == 64);
    ChildProcess unknown(folder.path(), "unknown", {program, "--config", config, "--frobnicate"});
    CHECK(unknown.wait(120s) == 64);
}

TEST_CASE("what is wrong is said in one line, with the exit status of its kind") {
    const TempFolder folder;
    const auto run = [&](const DaemonOptions& options) {
        DaemonProcess daemon(folder, write_configuration(folder, options));
        const auto status = daemon.process().wait(120s);
        CHECK(daemon.ready_text().empty());
        return std::pair(status, daemon.process().err());
    };
    DaemonOptions options;
    options.size = 64;

    SECTION("a key that does not exist") {
        options.daemon_more = "pool_frame = 3";
        const auto [status, text] = run(options);
        CHECK(status == 78);
        CHECK_THAT(text, ContainsSubstring("obscurad.toml:6:1: daemon.pool_frame: "));
        CHECK(std::count(text.begin(), text.end(), '\n') == 1);
    }
    SECTION("a configuration that is not there") {
        ChildProcess daemon(folder.path(), "gone",
                            {OBSCURA_BINARY_DIR "/emulator/obscurad", "--config", "/nowhere.toml"});
        CHECK(daemon.wait(120s) == 66);
        CHECK_THAT(daemon.err(), ContainsSubstring("/nowhere.toml"));
    }
    SECTION("an output folder that cannot be made") {
        options.frames_folder = "/proc/obscura/frames";
        const auto [status, text] = run(options);
        CHECK(status == 73);
        CHECK_THAT(text, ContainsSubstring("/proc/obscura/frames"));
    }
    SECTION("an output folder that cannot be written to") {
        options.frames_folder = "/proc";
        const auto [status, text] = run(options);
        CHECK(status == 73);
        CHECK_THAT(text, ContainsSubstring("/proc"));
    }
}

TEST_CASE("a trigger faster than the chip or the rendering is counted, and the daemon lives on") {
    const TempFolder folder;
    DaemonOptions options;
    options.size = 512;
    options.rate_hz = 5000;
    options.frames_folder = (folder.path() / "frames").string();
    DaemonProcess daemon(folder, write_configuration(folder, options));
    REQUIRE(daemon.wait_ready());
    wait_for_file(folder.path() / "frames" / "frame_000003.raw");
    daemon.process().send(SIGTERM);
    CHECK(daemon.process().wait(120s) == 0);
    const Json camera = Json::parse(daemon.statistics())["camera"];
    CHECK(camera["frames"] >= 3);
    CHECK(camera["missed_triggers"] > camera["frames"]);
    CHECK(camera["triggers"] ==
          camera["frames"].get<int>() + camera["missed_triggers"].get<int>() + camera["dropped"].get<int>());
}

TEST_CASE("SIGUSR1: counters are logged, statistics are written, and frames flow on") {
    const TempFolder folder;
    DaemonOptions options;
    options.size = 64;
    options.rate_hz = 50;
    options.frames_folder = (folder.path() / "frames").string();
    DaemonProcess daemon(folder, write_configuration(folder, options));
    REQUIRE(daemon.wait_ready());
    const auto wait_for_frame = [&](const char* name) { wait_for_file(folder.path() / "frames" / name); };
    wait_for_frame("frame_000010.raw");
    REQUIRE(daemon.statistics().empty());
    daemon.process().send(SIGUSR1);
    eventually([&] { return !daemon.statistics().empty() || !daemon.process().running(); });
    REQUIRE(daemon.process().running());
    const Json then = Json::parse(daemon.statistics());
    CHECK(then["camera"]["frames"] >= 10);
    CHECK(then["trigger"]["refused"] == 0);
    CHECK_THAT(daemon.process().err(), ContainsSubstring("SIGUSR1: "));
    const int frames = then["camera"]["frames"];
    wait_for_frame(fmt::format("frame_{:06}.raw", frames + 10).c_str());
    daemon.process().send(SIGTERM);
    CHECK(daemon.process().wait(120s) == 0);
    CHECK(Json::parse(daemon.statistics())["camera"]["frames"] >= frames + 10);
}

TEST_CASE("obscura trigger starts frames over UDP; other datagrams are counted and said once") {
    const TempFolder folder;
    const std::string address = own_address(1) + ":5002";
    const auto send = [&](const std::vector<std::string>& more) {
        std::vector<std::string> words{OBSCURA_BINARY_DIR "/tools/obscura", "trigger", "--udp", address};
        words.insert(words.end(), more.begin(), more.end());
        ChildProcess sender(folder.path(), "sender", words);
        const auto status = sender.wait(120s);
        return std::pair(status, sender.out() + sender.err());
    };
    CHECK(send({}) == std::pair(std::optional(69), "obscura trigger: " + address +
                                                       ": Connection refused: nothing listens there\n"));

    DaemonOptions options;
    options.size = 64;
    options.trigger_more = "source = \"udp\"\nlisten = \"" + address + "\"\n";
    DaemonProcess daemon(folder, write_configuration(folder, options));
    REQUIRE(daemon.wait_ready());
    const int rubbish = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(5002);
    inet_pton(AF_INET, own_address(1).c_str(), &to.sin_addr);
    for (const char* text : {"trigger", ""})
        sendto(rubbish, text, std::strlen(text), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
    close(rubbish);
    CHECK(send({"--rate", "20", "--frames", "5", "--stamp"}) ==
          std::pair(std::optional(0), "5 triggers sent to " + address + "\n"));
    Json now;
    eventually([&] {
        daemon.process().send(SIGUSR1);
        if (const std::string text = daemon.statistics(); !text.empty()) now = Json::parse(text);
        return !now.is_null() && now["camera"]["triggers"] >= 5;
    });
    CHECK(now["camera"]["triggers"] == 5);
    CHECK(now["trigger"]["refused"] == 2);
    daemon.process().send(SIGTERM);
    CHECK(daemon.process().wait(120s) == 0);
    const std::string said = daemon.process().err();
    const std::string line = "trigger udp: message dropped";
    CHECK(said.find(line) != std::string::npos);
    CHECK(said.find(line) == said.rfind(line));
}

TEST_CASE("SIGHUP: a good configuration is taken on, a bad one changes nothing, and frames flow on") {
    const TempFolder folder;
    const ServiceManager manager;
    DaemonOptions options;
    options.size = 64;
    options.rate_hz = 5;
    options.frames_folder = (folder.path() / "frames").string();
    DaemonProcess daemon(folder, write_configuration(folder, options), {manager.environment()});
    REQUIRE(daemon.wait_ready());
    CHECK(manager.next() == "READY=1");
    const auto hang_up = [&](const std::string& said) {
        daemon.process().send(SIGHUP);
        const std::string first = manager.next();
        CHECK(first.rfind("RELOADING=1\nMONOTONIC_USEC=", 0) == 0);
        CHECK(manager.next() == "READY=1");
        CHECK_THAT(daemon.process().err(), ContainsSubstring(said));
    };
    options.daemon_more = "pool_frame = 3";
    write_configuration(folder, options);
    hang_up("SIGHUP: nothing changed: " + (folder.path() / "obscurad.toml").string() +
            ":6:1: daemon.pool_frame: ");
    options.daemon_more = "scene_time = \"clock\"";
    options.rate_hz = 50;
    write_configuration(folder, options);
    hang_up("nothing changed: daemon.scene_time cannot change while running");
    options.daemon_more = "";
    write_configuration(folder, options);
    hang_up("obscurad.toml taken on");
    // Fifty a second from here on: in five seconds more than the old rate could ever have made.
    wait_for_file(folder.path() / "frames" / "frame_000100.raw");
    daemon.process().send(SIGTERM);
    CHECK(daemon.process().wait(120s) == 0);
    const Json json = Json::parse(daemon.statistics());
    CHECK(json["camera"]["frames"] >= 100);
    CHECK(json["camera"]["dropped"] == 0);
    // One run, one numbering: nothing was lost or restarted on the way.
    const int delivered = json["transports"]["file"]["delivered"];
    CHECK(std::filesystem::exists(
        folder.path() / "frames" /
        ("frame_" + std::string(delivered < 1000 ? "000" : "00") + std::to_string(delivered) + ".raw")));
}

#ifndef OBSCURA_SANITIZED // shadow memory does not fit under a limit
TEST_CASE("SIGHUP: a scene that needs too much memory is refused in one line, and frames flow on") {
    const TempFolder folder;
    const ServiceManager manager;
    DaemonOptions options;
    options.size = 64;
    options.rate_hz = 20;
    options.frames_folder = (folder.path() / "frames").string();
    options.daemon_more = "memory_limit_mib = 1024";
    DaemonProcess daemon(folder, write_configuration(folder, options), {manager.environment()});
    REQUIRE(daemon.wait_ready());
    CHECK(manager.next() == "READY=1");
    const std::string light = text_of(folder.path() / "scene.toml");
    const auto hang_up = [&](const std::string& more) {
        folder.write("scene.toml", light + more);
        daemon.process().send(SIGHUP);
        manager.next(); // RELOADING
        CHECK(manager.next() == "READY=1");
    };
    // FITS files whose headers promise more than there is, or than there is room for.
    const auto fits = [&](const char* name, long long width, long long height, long long planes,
                          std::uintmax_t bytes) {
        const auto card = [](const char* key, const std::string& value) {
            std::string c = fmt::format("{:<8}= {:>20}", key, value);
            c.resize(80, ' ');
            return c;
        };
        std::string header = card("SIMPLE", "T") + card("BITPIX", "8") + card("NAXIS", "3") +
                             card("NAXIS1", std::to_string(width)) + card("NAXIS2", std::to_string(height)) +
                             card("NAXIS3", std::to_string(planes)) + "END";
        header.resize(2880, ' ');
        const std::filesystem::path file = folder.write(name, header);
        std::filesystem::resize_file(file, bytes);
        return "albedo_texture = \"" + file.string() + "\"\n";
    };
    hang_up(fits("planes.fits", 1, 1, 2'000'000'000, 5760));
    CHECK_THAT(daemon.process().err(), ContainsSubstring("planes.fits: the file ends before its image"));
    hang_up(fits("wide.fits", 16384, 16384, 1, 5760));
    CHECK_THAT(daemon.process().err(), ContainsSubstring("wide.fits: needs 4096.0 MiB of memory; left are"));
    hang_up(fits("large.fits", 8192, 8192, 1, 2880 + 8192 * 8192));
    CHECK_THAT(daemon.process().err(), ContainsSubstring("large.fits: needs 1024.0 MiB of memory; left are"));
    const int done =
        static_cast<int>(std::distance(std::filesystem::directory_iterator(folder.path() / "frames"),
                                       std::filesystem::directory_iterator()));
    const auto later = folder.path() / "frames" / fmt::format("frame_{:06}.raw", done + 20);
    wait_for_file(later);
    CHECK(std::filesystem::exists(later));
    daemon.process().send(SIGTERM);
    CHECK(daemon.process().wait(120s) == 0);
}
#endif

TEST_CASE("the stamps of a run can be read by obscura timing") {
    const TempFolder folder;
    DaemonOptions options;
    options.size = 64;
    options.rate_hz = 50;
    options.frames_folder = (folder.path() / "frames").string();
    const std::string config = write_configuration(folder, options).string();
    const std::string stamps = (folder.path() / "stamps.csv").string();
    ChildProcess daemon(folder.path(), "daemon",
                        {OBSCURA_BINARY_DIR "/emulator/obscurad", "--config", config, "--timing", stamps});
    wait_for_file(folder.path() / "frames" / "frame_000020.raw");
    daemon.send(SIGTERM);
    REQUIRE(daemon.wait(120s) == 0);
    ChildProcess report(folder.path(), "report",
                        {OBSCURA_BINARY_DIR "/tools/obscura", "timing", stamps, "--format", "csv"});
    CHECK(report.wait(120s) == 0);
    CHECK_THAT(report.out(), ContainsSubstring("edge_to_first_row,"));
    ChildProcess nonsense(folder.path(), "nonsense", {OBSCURA_BINARY_DIR "/tools/obscura", "timing", config});
    CHECK(nonsense.wait(120s) == 66);
    CHECK_THAT(nonsense.err(), ContainsSubstring("obscurad.toml:1: this is no timing file"));
}

TEST_CASE("obscura timing names what frames of fast motion cost, for each acquisition") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(41);
    options.size = 128;
    options.rate_hz = 20;
    // A frame made ahead of its trigger has no rendering after it.
    options.render_more = "ahead = \"off\"\n";
    std::string scene = light_scene;
    scene.replace(scene.find("STARS"), 5, OBSCURA_SOURCE_DIR "/config/stars/bright.csv");
    // A quarter of a right angle and more in the exposure of 5 ms.
    scene.replace(scene.find("spin_rate_deg_per_s = 30"), 24, "spin_rate_deg_per_s = 6000");
    options.scene = folder.write("spinning.toml", scene).string();
    const std::string config = write_configuration(folder, options).string();
    const std::string stamps = (folder.path() / "stamps.csv").string();
    const auto ready = folder.path() / "ready";
    ChildProcess daemon(folder.path(), "daemon",
                        {OBSCURA_BINARY_DIR "/emulator/obscurad", "--config", config, "--timing", stamps,
                         "--ready-file", ready.string()});
    wait_for_file(ready);
    const std::string program = OBSCURA_BINARY_DIR "/tools/obscura";
    for (const char* name : {"first", "second"}) {
        ChildProcess client(folder.path(), name,
                            {program, "grab", "--address", options.address, "--frames", "3"});
        REQUIRE(client.wait(60s) == 0);
    }
    daemon.send(SIGTERM);
    REQUIRE(daemon.wait(120s) == 0);
    ChildProcess text(folder.path(), "text", {program, "timing", stamps});
    CHECK(text.wait(120s) == 0);
    CHECK_THAT(text.out(), ContainsSubstring("Acquisition 1\n") && ContainsSubstring("Acquisition 2\n") &&
                               ContainsSubstring("rendering: scene at motion instants") &&
                               // Where other programs took the cores, those are the larger cause.
                               ContainsSubstring(" would give about ") &&
                               ContainsSubstring("involuntary context switches a frame"));
    ChildProcess table(folder.path(), "table", {program, "timing", stamps, "--format", "csv"});
    CHECK(table.wait(120s) == 0);
    CHECK_THAT(table.out(), ContainsSubstring("\n1,rendering,") && ContainsSubstring("\n2,rendering,") &&
                                ContainsSubstring("\n2,\"rendering: scene at motion instants\","));
}

TEST_CASE("no thread of a serving daemon has a capability left") {
    if (geteuid() != 0) {
        WARN("skipped: only root has capabilities to give up");
        return;
    }
#ifdef __SANITIZE_THREAD__
    WARN("skipped: ThreadSanitizer holds back the signals that tell threads to let go");
    return;
#endif
    const auto capabilities = [](const std::filesystem::path& status_file) {
        std::map<std::string, std::uint64_t> sets;
        std::istringstream status(text_of(status_file));
        for (std::string key, value; status >> key && std::getline(status, value);)
            if (key == "NoNewPrivs:" || key.rfind("Cap", 0) == 0) sets[key] = std::stoull(value, nullptr, 16);
        return sets;
    };
    constexpr std::uint64_t set_bounding = 1ULL << 8, raise_limits = 1ULL << 24,
                            real_time = 1ULL << 23 | 1ULL << 14;
    const std::uint64_t own = capabilities("/proc/self/status")["CapEff:"];
    if (own == 0) {
        WARN("skipped: this root has no capabilities either");
        return;
    }
    // Where even root may not raise limits, what real time needs stays.
    const std::uint64_t tolerated = (own & raise_limits) != 0 ? 0 : real_time;
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(31);
    options.size = 64;
    DaemonProcess daemon(folder, write_configuration(folder, options));
    REQUIRE(daemon.wait_ready());
    const auto check_all_threads = [&] {
        int threads = 0;
        for (const auto& task : std::filesystem::directory_iterator(
                 "/proc/" + std::to_string(daemon.process().pid()) + "/task")) {
            auto sets = capabilities(task.path() / "status");
            CAPTURE(task.path().string(), text_of(task.path() / "comm"));
            REQUIRE(sets.size() == 6);
            CHECK(sets["NoNewPrivs:"] == 1);
            for (const char* set : {"CapEff:", "CapPrm:"})
                CHECK((sets[set] & ~tolerated) == 0);
            if ((own & set_bounding) != 0) CHECK((sets["CapBnd:"] & ~tolerated) == 0);
            CHECK(sets["CapInh:"] == 0);
            CHECK(sets["CapAmb:"] == 0);
            ++threads;
        }
        CHECK(threads > 5);
    };
    check_all_threads();
    // It serves all the same: a client comes, streams and goes.
    ChildProcess client(
        folder.path(), "grab",
        {OBSCURA_BINARY_DIR "/tools/obscura", "grab", "--address", options.address, "--frames", "3"});
    CHECK(client.wait(60s) == 0);
    check_all_threads();
    daemon.process().send(SIGTERM);
    CHECK(daemon.process().wait(120s) == 0);
    CHECK_THAT(daemon.process().err(), ContainsSubstring("capabilities: given up"));
    CHECK_THAT(daemon.process().err(), !ContainsSubstring("not all given up"));
}

namespace {

struct ThreadState {
    std::string name;
    int nice = 0, priority = 0, policy = 0;
};

// Fields 19, 40 and 41 of proc(5)'s stat: nice level, real-time priority and scheduling policy.
std::vector<ThreadState> threads_of(pid_t process) {
    std::vector<ThreadState> all;
    for (const auto& task :
         std::filesystem::directory_iterator("/proc/" + std::to_string(process) + "/task")) {
        const std::string text = text_of(task.path() / "stat");
        const std::size_t open = text.find('('), close = text.rfind(')');
        if (close == std::string::npos) continue; // has ended
        std::istringstream rest(text.substr(close + 1));
        std::vector<std::string> fields{"pid", "name"};
        for (std::string field; rest >> field;)
            fields.push_back(field);
        all.push_back({text.substr(open + 1, close - open - 1), std::stoi(fields.at(18)),
                       std::stoi(fields.at(39)), std::stoi(fields.at(40))});
    }
    return all;
}

} // namespace

TEST_CASE("threads of a serving daemon have the scheduling classes of the configuration") {
    const TempFolder folder;
    DaemonOptions options;
    options.size = 128;
    options.rate_hz = 20;
    options.frames_folder = (folder.path() / "frames").string();
    options.more = "[threads]\nrelease_priority = 33\n";
    std::string said = "rendering: ";
    const int own_nice = ::getpriority(PRIO_PROCESS, 0); // which children begin with
    int session_nice = -7;
    ThreadState wanted{"render", -7, 0, SCHED_OTHER};
    SECTION("as any program, at a nice level") {
        options.more += "render_nice = -7\n";
    }
    SECTION("in longer time slices") {
        options.more += "render_class = \"batch\"\nrender_nice = -7\n";
        wanted.policy = SCHED_BATCH;
    }
    SECTION("before other programs, below the threads with deadlines") {
        options.more += "render_class = \"rr\"\nrender_priority = 3\n";
        wanted = {"render", own_nice, 3, SCHED_RR};
        session_nice = 0;
        said = "real time: not permitted";
    }
    options.more += "[render]\nthreads = 2\n";
    const std::filesystem::path file = write_configuration(folder, options);
    // The options above replace the section that the configuration has already.
    std::string text = text_of(file);
    text.erase(text.find("[render]\nsamples_per_pixel"),
               std::string("[render]\nsamples_per_pixel = 1\n").size());
    folder.write("obscurad.toml", text);
    // A session of its own, as a service has: among sessions Linux shares the processors out first.
    ChildProcess daemon(
        folder.path(), "daemon",
        {"/usr/bin/setsid", OBSCURA_BINARY_DIR "/emulator/obscurad", "--config", file.string()});
    wait_for_file(folder.path() / "frames" / "frame_000010.raw");
    const std::vector<ThreadState> threads = threads_of(daemon.pid());
    const std::string autogroup = text_of("/proc/" + std::to_string(daemon.pid()) + "/autogroup");
    daemon.send(SIGTERM);
    REQUIRE(daemon.wait(120s) == 0);
    const std::string log = daemon.err();
    if (log.find(said) != std::string::npos || log.find("real time: not permitted") != std::string::npos) {
        WARN("skipped: this process may not have such threads");
        // The frames came all the same, and the refusal is said once.
        CHECK(std::filesystem::exists(folder.path() / "frames" / "frame_000010.raw"));
        CHECK(log.find(said) == log.rfind(said));
        return;
    }
    int renderers = 0, pipelines = 0, releases = 0;
    for (const ThreadState& thread : threads) {
        CAPTURE(thread.name, thread.nice, thread.priority, thread.policy);
        if (thread.name == "render") { // the render thread and the renderer's workers
            CHECK(thread.nice == wanted.nice);
            CHECK(thread.priority == wanted.priority);
            CHECK(thread.policy == wanted.policy);
            ++renderers;
        } else if (thread.name == "pipeline") {
            CHECK(thread.priority == 65); // the detector's
            CHECK(thread.policy == SCHED_FIFO);
            ++pipelines;
        } else if (thread.name == "release") {
            CHECK(thread.priority == 33);
            CHECK(thread.policy == SCHED_FIFO);
            ++releases;
        } else if (thread.name == "detector") {
            CHECK(thread.priority == 65);
            CHECK(thread.policy == SCHED_FIFO);
        } else if (thread.name == "obscurad") {
            CHECK(thread.nice == own_nice);
            CHECK(thread.policy == SCHED_OTHER);
        }
    }
    CHECK(renderers >= 2);
    CHECK(pipelines == 1);
    CHECK(releases == 1);
    if (!autogroup.empty())
        CHECK_THAT(autogroup, ContainsSubstring("nice " + std::to_string(session_nice) + "\n"));
}
