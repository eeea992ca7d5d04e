// SPDX-License-Identifier: Apache-2.0
#include "emulator/daemon/start_watch.hpp"

#include "core/clock.hpp"
#include "core/error.hpp"
#include "core/realtime/log.hpp"
#include "core/realtime/realtime.hpp"
#include "host/service_notify.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <string>
#include <utility>

namespace obscura::emulator {
namespace {

constexpr std::chrono::milliseconds signal_poll{50};
/// For the loading to end by itself, which reports what it was at. SIGTERM ends a start within a second.
constexpr std::int64_t stop_timeout_ns = 700 * ns_per_ms;
constexpr std::int64_t between_notices_ns = ns_per_s;
/// The service manager waits so much longer for READY after each notice.
constexpr std::int64_t extended_ns = 20 * ns_per_s;

} // namespace

StartWatch::StartWatch(const StartProgress& progress, std::function<bool()> stop_wanted)
    : progress_(progress), stop_wanted_(std::move(stop_wanted)), thread_([this] { run(); }) {}

StartWatch::~StartWatch() {
    over_ = true;
    thread_.join();
}

void StartWatch::run() {
    name_this_thread("start-watch");
    const MonotonicClock clock;
    Time asked{INT64_MAX}, next = clock.now() + between_notices_ns;
    bool told = false;
    for (; !over_.load(); std::this_thread::sleep_for(signal_poll)) {
        const Time now = clock.now();
        if (stop_wanted_()) asked = std::min(asked, now);
        if (now > asked && now - asked > stop_timeout_ns) {
            log_notice("stopped while starting: {}", progress_.report().words());
            std::_Exit(exit_ok);
        }
        if (now < next) continue;
        next = now + between_notices_ns;
        told = true;
        host::notify_service_manager(fmt::format("STATUS={}\nWATCHDOG=1\nEXTEND_TIMEOUT_USEC={}",
                                                 progress_.report().text(), extended_ns / ns_per_us));
    }
    if (told) host::notify_service_manager("STATUS=");
}

} // namespace obscura::emulator
