// SPDX-License-Identifier: Apache-2.0
#include "emulator/monitor/frame_verbs.hpp"

#include "transports/watch/watch.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

namespace obscura::emulator {
namespace {

using Cameras = std::vector<transports::WatchTransport*>;

constexpr double largest_pid = 1 << 22; // of Linux

/// Which camera is meant.
struct Chosen {
    std::uint32_t camera = 0, pid = 0;

    config::Keys keys() {
        return {config::key("camera", &camera)
                    .range(0, 1000)
                    .help("Number of the camera, in the order of the configuration"),
                config::key("pid", &pid)
                    .range(0, largest_pid)
                    .help("Process that is meant; 0: whichever this is")};
    }
};

struct Looked : Chosen {
    std::uint32_t period_us = 0;

    config::Keys keys() {
        config::Keys all = Chosen::keys();
        all.push_back(config::key("period_us", &period_us)
                          .unit("us")
                          .range(0, 60'000'000)
                          .help("Least time between two of them; 0: all"));
        return all;
    }
};

/// Throws std::invalid_argument.
transports::WatchTransport& watched(const Cameras& cameras, const Chosen& chosen) {
    const auto refuse = [](const std::string& why) { throw std::invalid_argument(why); };
    if (chosen.pid != 0 && chosen.pid != static_cast<std::uint32_t>(::getpid()))
        refuse(fmt::format("pid: this is process {}", ::getpid()));
    if (chosen.camera >= cameras.size())
        refuse(
            fmt::format("camera: there is no camera {}, allowed 0 to {}", chosen.camera, cameras.size() - 1));
    if (cameras[chosen.camera] == nullptr) refuse("no frames are kept");
    return *cameras[chosen.camera];
}

std::string ring_answer(transports::WatchTransport& watch, std::uint32_t camera) {
    return fmt::format(R"({{"pid":{},"camera":{},"watched_s":{},"tai_offset_ns":{}}})", ::getpid(), camera,
                       transports::WatchTransport::watched_ns / ns_per_s, watch.tai_offset_ns());
}

std::vector<service::Result> results() {
    return {{"pid", "integer", "", "Process of the daemon"},
            {"camera", "integer", "", "Number of the camera"},
            {"watched_s", "integer", "s", "Time for which frames are copied after each request"},
            {"tai_offset_ns", "integer", "ns", "Makes TAI of the instants of frames"}};
}

} // namespace

std::vector<MonitorVerb> frame_verbs(std::vector<transports::WatchTransport*> cameras) {
    const auto all = std::make_shared<const Cameras>(std::move(cameras));
    return {
        monitor_verb<Chosen>(
            "ring", "Passes the memory of a camera's newest frames, and an eventfd that each of them signals",
            results(),
            [all](const Chosen& chosen) {
                transports::WatchTransport& watch = watched(*all, chosen);
                transports::FrameRing& ring = watch.ring();
                return MonitorAnswer(ring_answer(watch, chosen.camera),
                                     {ring.descriptor(), ring.hand_over()});
            }),
        monitor_verb<Looked>("watch", "Has frames of a camera copied to that memory for the next seconds",
                             results(),
                             [all](const Looked& looked) {
                                 transports::WatchTransport& watch = watched(*all, looked);
                                 watch.look(looked.period_us * ns_per_us);
                                 return MonitorAnswer(ring_answer(watch, looked.camera));
                             }),
    };
}

} // namespace obscura::emulator
