// SPDX-License-Identifier: Apache-2.0
// Device nodes that vanish under the running daemon and come back: a video node, a USB display, a GPIO chip.
// umockdev stands for the kernel, tests/support/gpio_nodes.c for libgpiod. To be run by umockdev-wrapper.
// What needs a kernel (libgpiod's own requests, v4l2loopback, usbfs) is in tests/kernel.
#include "tests/integration/daemon_bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/umockdev_devices.hpp"

#include <nlohmann/json.hpp>

#include <cstdlib>
#include <fstream>

namespace device_nodes_test {

using namespace obscura::test;

namespace {

constexpr int turns = 3;

/// A daemon whose counters can be read at any time.
class WatchedDaemon {
public:
    WatchedDaemon(const TempFolder& folder, DaemonOptions options)
        : frames_(folder.path() / "frames"),
          process_(folder, write_configuration(folder, prepared(std::move(options)))) {}

    DaemonProcess& process() { return process_; }
    nlohmann::json counters() {
        std::filesystem::remove(frames_.parent_path() / "obscurad.json");
        process_.process().send(SIGUSR1);
        nlohmann::json told;
        eventually([&] {
            told = nlohmann::json::parse(process_.statistics(), nullptr, false);
            return !told.is_discarded();
        });
        return told;
    }
    [[nodiscard]] std::size_t frames() const {
        std::size_t count = 0;
        for (const auto& entry : std::filesystem::directory_iterator(frames_))
            count += entry.path().extension() == ".raw" ? 1 : 0;
        return count;
    }
    /// Whether `more` further frames are stored.
    bool goes_on(std::size_t more) {
        const std::size_t before = frames();
        return eventually([&] { return frames() >= before + more; });
    }
    /// Lines of the log that hold `text`.
    [[nodiscard]] int said(const std::string& text) const {
        const std::string log = process_.log();
        int lines = 0;
        for (std::size_t at = 0; (at = log.find(text, at)) != std::string::npos; at += text.size())
            ++lines;
        return lines;
    }
    void end() {
        process_.process().send(SIGTERM);
        CHECK(process_.process().wait(std::chrono::seconds(60)) == 0);
    }

private:
    DaemonOptions prepared(DaemonOptions options) const {
        std::filesystem::create_directories(frames_);
        options.frames_folder = frames_.string();
        return options;
    }

    std::filesystem::path frames_;
    DaemonProcess process_;
};

} // namespace

TEST_CASE("a video node and a USB display vanish and come back under the running daemon") {
    Testbed bed;
    VideoNode node(bed);
    UsbDisplay display(bed, "MOCK-1");
    node.plug();
    display.plug();
    const TempFolder folder;
    DaemonOptions options;
    options.size = UsbDisplay::width, options.height = UsbDisplay::height;
    options.rate_hz = 20;
    options.more = "[v4l2]\nenabled = true\n[stimulator]\nenabled = true\ndither = \"none\"\n";
    WatchedDaemon daemon(folder, options);
    const bool ready = daemon.process().wait_ready();
    INFO(daemon.process().log());
    REQUIRE(ready);
    REQUIRE(eventually([&] { return node.images().size() > 3 && !display.screen().empty(); }));
    for (int turn = 1; turn <= turns; ++turn) {
        node.unplug();
        display.unplug();
        nlohmann::json told;
        REQUIRE(eventually([&] {
            told = daemon.counters()["transports"];
            return told["v4l2"]["no_node"] > 3 && told["stimulator"]["display"] != "connected" &&
                   told["stimulator"]["dropped"] > 3 &&
                   told["v4l2"]["trouble"] == "v4l2: /dev/video10: is not there";
        }));
        CHECK(told["v4l2"]["node_lost"] == turn);
        CHECK(told["v4l2"]["node_opened"] == turn);
        CHECK(told["stimulator"]["connects"] == turn);
        REQUIRE(daemon.goes_on(10)); // to files
        // One line for the loss, one for the wait, however many frames find no node.
        CHECK(daemon.said("v4l2: /dev/video10: is gone") == turn);
        CHECK(daemon.said("v4l2: /dev/video10: is not there") == turn);
        CHECK(daemon.said("not plugged in, waiting for it") == turn);
        const std::size_t images = node.images().size();
        node.plug();
        display.plug();
        REQUIRE(eventually([&] {
            told = daemon.counters()["transports"];
            return node.images().size() > images + 3 && told["stimulator"]["display"] == "connected";
        }));
        CHECK(told["v4l2"]["trouble"] == "");
        CHECK(told["v4l2"]["node_opened"] == turn + 1);
        CHECK(told["stimulator"]["connects"] == turn + 1);
        CHECK(daemon.said("takes images again") == turn);
        const std::uint64_t shown = told["stimulator"]["delivered"];
        REQUIRE(
            eventually([&] { return daemon.counters()["transports"]["stimulator"]["delivered"] > shown; }));
        CHECK(display.screen().size() == std::size_t{UsbDisplay::width} * UsbDisplay::height);
    }
    const nlohmann::json told = daemon.counters()["transports"];
    for (const char* transport : {"file", "v4l2", "stimulator"})
        CHECK(told[transport]["delivered"].get<std::uint64_t>() +
                  told[transport]["dropped"].get<std::uint64_t>() + 8 >=
              told[transport]["submitted"].get<std::uint64_t>());
    CHECK(told["file"]["dropped"] == 0);
    daemon.end();
}

TEST_CASE("a GPIO chip vanishes and comes back under the running daemon") {
    const Testbed bed;
    const std::filesystem::path chip = bed.root() + "/dev/gpiochip7";
    const TempFolder folder;
    const auto pulse = [&chip] { std::ofstream(chip, std::ios::app) << '.'; };
    std::filesystem::create_directories(chip.parent_path());
    std::ofstream{chip};
    DaemonOptions options;
    options.size = 64;
    options.rate_hz = 20;
    options.trigger_more = "source = \"gpio\"\nline = \"gpiochip7:3\"\n";
    const std::string preloaded = getenv("LD_PRELOAD");
    setenv("LD_PRELOAD", (preloaded + ":" + getenv("OBSCURA_GPIO_NODES")).c_str(), 1);
    WatchedDaemon daemon(folder, options);
    setenv("LD_PRELOAD", preloaded.c_str(), 1);
    const bool ready = daemon.process().wait_ready();
    INFO(daemon.process().log());
    REQUIRE(ready);
    const auto frame_of_edge = [&] {
        const std::size_t before = daemon.frames();
        return eventually([&] {
            pulse();
            std::this_thread::sleep_for(std::chrono::milliseconds(50));
            return daemon.frames() > before;
        });
    };
    REQUIRE(frame_of_edge());
    for (int turn = 1; turn <= turns; ++turn) {
        std::filesystem::remove(chip);
        REQUIRE(eventually([&] { return daemon.said("the input has vanished") == turn; }));
        REQUIRE(eventually([&] { return daemon.counters()["clock"]["state"] == "free"; }));
        const std::size_t before = daemon.frames();
        std::this_thread::sleep_for(std::chrono::milliseconds(500));
        CHECK(daemon.frames() == before);
        CHECK(daemon.said("the input has vanished") == turn);
        std::ofstream{chip};
        REQUIRE(eventually([&] { return daemon.said("the input is back") == turn; }));
        REQUIRE(frame_of_edge());
    }
    CHECK(daemon.said("the input has vanished") == turns);
    CHECK(daemon.said("the input is back") == turns);
    daemon.end();
}

} // namespace device_nodes_test
