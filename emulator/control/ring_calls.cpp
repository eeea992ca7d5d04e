// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/ring_calls.hpp"

#include "core/error.hpp"
#include "transports/watch/watch.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <memory>
#include <utility>

namespace obscura::emulator {
namespace {

using service::Answer;
using service::Failure;
using service::FailureCode;
using service::Fields;
using service::Permission;
using service::Work;

constexpr double max_ring_pid = 1 << 22; // of Linux

/// Which camera is meant.
struct RingCamera {
    std::uint32_t camera = 0, pid = 0;

    Fields fields() {
        return {{camera_key(&camera), config::key("pid", &pid)
                                          .range(0, max_ring_pid)
                                          .help("Process that is meant; 0: whichever this is")}};
    }
};

struct WatchedRing : RingCamera {
    std::uint32_t period_us = 0;

    Fields fields() {
        Fields all = RingCamera::fields();
        all.keys.push_back(config::key("period_us", &period_us)
                               .unit("us")
                               .range(0, 60'000'000)
                               .help("Least time between two of them; 0: all"));
        return all;
    }
};

/// Throws Failure.
transports::WatchTransport& checked_watch(const WatchedCameras& cameras, const RingCamera& which) {
    if (which.pid != 0 && which.pid != static_cast<std::uint32_t>(::getpid())) {
        Failure failure(FailureCode::bad_argument, fmt::format("pid: this is process {}", ::getpid()));
        failure.field = "pid";
        throw failure;
    }
    check_camera_number(cameras.size(), which.camera);
    transports::WatchTransport* const watch = cameras[which.camera];
    if (watch == nullptr) throw Failure(FailureCode::not_now, "the daemon keeps no frames for calls");
    return *watch;
}

Answer told_of_ring(transports::WatchTransport& watch, std::uint32_t camera) {
    return {{{"pid", ::getpid()},
             {"camera", camera},
             {"watched_s", transports::WatchTransport::watched_ns / ns_per_s},
             {"tai_offset_ns", watch.tai_offset_ns()}}};
}

std::vector<service::Result> ring_results() {
    return {{"pid", "integer", "", "Process of the daemon"},
            {"camera", "integer", "", "Number of the camera"},
            {"watched_s", "integer", "s", "Time for which frames are copied after each request"},
            {"tai_offset_ns", "integer", "ns", "Makes TAI of the instants of frames"}};
}

/// Another descriptor of the file, which stays open when that of the ring becomes another reader's.
FileDescriptor second_descriptor(int descriptor) {
    FileDescriptor second(::fcntl(descriptor, F_DUPFD_CLOEXEC, 0));
    if (!second) throw HardwareError(fmt::format("ring: {}", std::strerror(errno)));
    return second;
}

} // namespace

RingFiles hand_over_ring(transports::WatchTransport& watch) {
    transports::FrameRing& ring = watch.ring();
    return {second_descriptor(ring.descriptor()), second_descriptor(ring.hand_over())};
}

service::Calls ring_calls(const WatchedCameras& cameras, std::function<RingFiles(std::size_t camera)> files) {
    service::Call ring = service::call<RingCamera>(
        "ring", Permission::view,
        "Hands over the memory of a camera's newest frames, and an eventfd that each of them signals. Over a Unix socket only.",
        [cameras, files = std::move(files)](const RingCamera& which, Work& /*work*/) {
            Answer answer = told_of_ring(checked_watch(cameras, which), which.camera);
            try {
                const auto handed = std::make_shared<RingFiles>(files(which.camera));
                answer.descriptors = {(*handed)[0].get(), (*handed)[1].get()};
                answer.keep = handed;
            } catch (const HardwareError& error) {
                throw Failure(FailureCode::busy, error.what());
            }
            return answer;
        });
    service::Call watch = service::call<WatchedRing>(
        "watch", Permission::view,
        "Has frames of a camera copied to the memory of ring for the next seconds.",
        [cameras](const WatchedRing& which, Work& /*work*/) {
            transports::WatchTransport& watched = checked_watch(cameras, which);
            watched.look(which.period_us * ns_per_us);
            return told_of_ring(watched, which.camera);
        });
    ring.results = ring_results();
    watch.results = ring_results();
    return {std::move(ring), std::move(watch)};
}

} // namespace obscura::emulator
