// SPDX-License-Identifier: Apache-2.0
#include "emulator/render/render_scheduling.hpp"

#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <optional>

namespace obscura::emulator {
namespace {

// Linux keeps the nice level per thread, and takes a thread id for that of a process.
RealtimeGrant set_nice(int nice) noexcept {
    if (setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), nice) == 0) return {true, {}};
    return {false, fmt::format("nice level {} refused: {}", nice, std::strerror(errno))};
}

int nice_of_this_thread() noexcept {
    return getpriority(PRIO_PROCESS, static_cast<id_t>(gettid()));
}

int policy_of(RenderClass c) noexcept {
    switch (c) {
    case RenderClass::batch:
        return SCHED_BATCH;
    case RenderClass::rr:
        return SCHED_RR;
    case RenderClass::fifo:
        return SCHED_FIFO;
    case RenderClass::other:
        break;
    }
    return SCHED_OTHER;
}

} // namespace

RealtimeGrant schedule_this_thread(const RenderScheduling& wanted) noexcept {
    sched_param param{};
    if (wanted.has_priority()) param.sched_priority = wanted.priority;
    const int policy = policy_of(wanted.policy);
    if (const int rc = pthread_setschedparam(pthread_self(), policy, &param); rc != 0)
        return {false, fmt::format("class {} refused: {}", name_of(wanted.policy), std::strerror(rc))};
    if (wanted.has_priority() || wanted.nice == 0) return {true, {}};
    return set_nice(wanted.nice);
}

RealtimeGrant scheduling_permitted(const RenderScheduling& wanted) noexcept {
    if (wanted.has_priority()) return realtime_permitted(wanted.priority);
    const int before = nice_of_this_thread();
    // A higher level needs no permission, and could not be taken back without one.
    if (wanted.nice >= before || wanted.nice == 0) return {true, {}};
    RealtimeGrant grant = set_nice(wanted.nice);
    if (grant.granted) set_nice(before);
    return grant;
}

void enter_render_worker(const RenderScheduling& wanted) noexcept {
    thread_local std::optional<RenderScheduling> entered;
    if (entered == wanted) return;
    entered = wanted;
    name_this_thread("render");
    pin_this_thread(wanted.cores);
    schedule_this_thread(wanted);
    prefault_stack();
}

} // namespace obscura::emulator
