// SPDX-License-Identifier: Apache-2.0
#include "core/realtime/realtime.hpp"

#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>

namespace obscura {
namespace {

thread_local bool declared_realtime = false;

cpu_set_t cpu_set_of(const CoreSet& cores) noexcept {
    cpu_set_t set;
    CPU_ZERO(&set);
    for (std::size_t core = 0; core < cores.size(); ++core)
        if (cores[core]) CPU_SET(core, &set);
    return set;
}

} // namespace

std::optional<CoreSet> parse_cores(std::string_view text) {
    static_assert(CPU_SETSIZE == CoreSet().size());
    CoreSet cores;
    const char* at = text.data();
    const char* const end = at + text.size();
    if (text.empty()) return cores;
    const auto number = [&](std::size_t& value) {
        const auto [rest, error] = std::from_chars(at, end, value);
        at = rest;
        return error == std::errc() && value < cores.size();
    };
    for (;;) {
        std::size_t first = 0;
        if (!number(first)) return std::nullopt;
        std::size_t last = first;
        if (at != end && *at == '-') {
            ++at;
            if (!number(last) || last < first) return std::nullopt;
        }
        for (std::size_t core = first; core <= last; ++core)
            cores.set(core);
        if (at == end) return cores;
        if (*at++ != ',') return std::nullopt;
    }
}

std::string cores_text(const CoreSet& cores) {
    std::string text;
    for (std::size_t first = 0; first < cores.size(); ++first) {
        if (!cores[first]) continue;
        std::size_t last = first;
        while (last + 1 < cores.size() && cores[last + 1])
            ++last;
        text += fmt::format("{}{}", text.empty() ? "" : ",", first);
        if (last > first) text += fmt::format("-{}", last);
        first = last;
    }
    return text.empty() ? "any" : text;
}

CoreSet permitted_cores() noexcept {
    CoreSet cores;
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set) != 0) return cores;
    for (std::size_t core = 0; core < cores.size(); ++core)
        if (CPU_ISSET(core, &set)) cores.set(core);
    return cores;
}

RealtimeGrant pin_this_thread(const CoreSet& cores) noexcept {
    if (cores.none()) return {true, {}};
    const cpu_set_t set = cpu_set_of(cores);
    const int rc = pthread_setaffinity_np(pthread_self(), sizeof set, &set);
    if (rc == 0) return {true, {}};
    return {false, fmt::format("cores {} refused: {}", cores_text(cores), std::strerror(rc))};
}

void enter_thread(const char* name, const ThreadSettings& settings) noexcept {
    name_this_thread(name);
    pin_this_thread(settings.cores);
    if (settings.priority > 0) make_this_thread_realtime(settings.priority);
}

void declare_this_thread_realtime() noexcept {
    declared_realtime = true;
    prefault_stack();
}

[[gnu::noinline]] void prefault_stack() noexcept {
    constexpr std::size_t page = 4096;
    unsigned char touched[prefaulted_stack_bytes]; // NOLINT(cppcoreguidelines-pro-type-member-init)
    // Volatile, since nothing reads what is written.
    volatile unsigned char* const pages = touched;
    for (std::size_t at = 0; at < prefaulted_stack_bytes; at += page)
        pages[at] = 0;
}

bool this_thread_is_realtime() noexcept {
    return declared_realtime;
}

void name_this_thread(const char* name) noexcept {
    char shortened[16] = {};
    std::strncpy(shortened, name, sizeof shortened - 1);
    pthread_setname_np(pthread_self(), shortened);
    // Reduce the timer slack: outside SCHED_FIFO its default adds 50 us to every wake-up.
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
