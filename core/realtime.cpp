#include "core/realtime.hpp"

#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace obscura {
namespace {

thread_local bool declared_realtime = false;

} // namespace

void declare_this_thread_realtime() noexcept {
    declared_realtime = true;
}

bool this_thread_is_realtime() noexcept {
    return declared_realtime;
}

void name_this_thread(const char* name) noexcept {
    char shortened[16] = {};
    std::strncpy(shortened, name, sizeof shortened - 1);
    pthread_setname_np(pthread_self(), shortened);
    // Without SCHED_FIFO the default 50 us of timer slack would be added to every wake-up.
    prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
}

RealtimeGrant make_this_thread_realtime(int priority) noexcept {
    sched_param param{};
    param.sched_priority = std::clamp(priority, 1, 99);
    // pthread functions return a positive errno.
    const int rc = pthread_setschedparam(pthread_self(), SCHED_FIFO, &param);
    if (rc == 0) return {true, {}};
    return {false, fmt::format("SCHED_FIFO {} refused: {}", param.sched_priority, std::strerror(rc))};
}

RealtimeGrant realtime_permitted(int priority) noexcept {
    int policy = 0;
    sched_param before{};
    pthread_getschedparam(pthread_self(), &policy, &before);
    RealtimeGrant grant = make_this_thread_realtime(priority);
    if (grant.granted) pthread_setschedparam(pthread_self(), policy, &before);
    return grant;
}

RealtimeGrant lock_memory() noexcept {
    if (mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return {true, {}};
    return {false, fmt::format("mlockall refused: {}", std::strerror(errno))};
}

} // namespace obscura
