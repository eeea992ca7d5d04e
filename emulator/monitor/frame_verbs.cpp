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

constexpr std::uint64_t largest_pid = std::uint64_t{1} << 22; // of Linux

std::vector<VerbParameter> parameters(std::vector<VerbParameter> more = {}) {
    more.insert(more.begin(),
                {{"camera", "Number of the camera, in the order of the configuration", 0, 1000, 0},
                 {"pid", "Process that is meant; 0: whichever this is", 0, largest_pid, 0}});
    return more;
}

/// Throws std::invalid_argument.
transports::WatchTransport& chosen(const Cameras& cameras, const VerbArguments& arguments) {
    const auto refuse = [](const std::string& why) { throw std::invalid_argument(why); };
    const std::uint64_t pid = arguments.at("pid"), camera = arguments.at("camera");
    if (pid != 0 && pid != static_cast<std::uint64_t>(::getpid()))
        refuse(fmt::format("pid: this is process {}", ::getpid()));
    if (camera >= cameras.size())
        refuse(fmt::format("camera: there is no camera {}, allowed 0 to {}", camera, cameras.size() - 1));
    if (cameras[camera] == nullptr) refuse("no frames are kept");
    return *cameras[camera];
}

std::string answer_of(transports::WatchTransport& watch, const VerbArguments& arguments) {
    return fmt::format(R"({{"pid":{},"camera":{},"watched_s":{},"tai_offset_ns":{}}})", ::getpid(),
                       arguments.at("camera"), transports::WatchTransport::watched_ns / ns_per_s,
                       watch.tai_offset_ns());
}

} // namespace

std::vector<MonitorVerb> frame_verbs(std::vector<transports::WatchTransport*> cameras) {
    const auto all = std::make_shared<const Cameras>(std::move(cameras));
    return {
        {"ring", "Hands over the memory of a camera's newest frames, and an event that tells of each",
         parameters(),
         [all](const VerbArguments& arguments) {
             transports::WatchTransport& watch = chosen(*all, arguments);
             transports::FrameRing& ring = watch.ring();
             return MonitorAnswer(answer_of(watch, arguments), {ring.descriptor(), ring.hand_over()});
         }},
        {"watch", "Has frames of a camera copied to that memory for the next seconds",
         parameters({{"period_us", "Least time between two of them; 0: all", 0, 60'000'000, 0}}),
         [all](const VerbArguments& arguments) -> MonitorAnswer {
             transports::WatchTransport& watch = chosen(*all, arguments);
             watch.look(static_cast<std::int64_t>(arguments.at("period_us")) * ns_per_us);
             return answer_of(watch, arguments);
         }},
    };
}

} // namespace obscura::emulator
