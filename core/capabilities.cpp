// SPDX-License-Identifier: Apache-2.0
#include "core/capabilities.hpp"

#include <fmt/format.h>
#include <linux/capability.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <set>
#include <thread>

namespace obscura {
namespace {

std::atomic<std::uint64_t> keep_bits{0};
std::atomic<int> answers{0}, refusals{0};

struct CapabilitySets {
    __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
    __user_cap_data_struct halves[2] = {};
    bool get() noexcept { return syscall(SYS_capget, &header, halves) == 0; }
    bool set() noexcept { return syscall(SYS_capset, &header, halves) == 0; }
};

/// Drops the capabilities of the calling thread. Makes system calls only: it runs in a signal handler.
bool drop_here() noexcept {
    const std::uint64_t keep = keep_bits.load();
    // Drop the bounding set first: that needs CAP_SETPCAP. Failure is harmless: a thread without CAP_SETPCAP
    // cannot gain capabilities either.
    for (int capability = 0; capability < 64; ++capability)
        if ((keep >> capability & 1) == 0) prctl(PR_CAPBSET_DROP, capability, 0L, 0L, 0L);
    prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_CLEAR_ALL, 0L, 0L, 0L);
    CapabilitySets sets;
    if (!sets.get()) return false;
    for (int half = 0; half < 2; ++half) {
        const auto kept = static_cast<std::uint32_t>(keep >> 32 * half);
        sets.halves[half].effective &= kept;
        sets.halves[half].permitted &= kept;
        sets.halves[half].inheritable = 0;
    }
    return sets.set() && prctl(PR_SET_NO_NEW_PRIVS, 1L, 0L, 0L, 0L) == 0;
}

extern "C" void on_drop_signal(int) {
    const int before = errno;
    if (!drop_here()) refusals.fetch_add(1);
    answers.fetch_add(1);
    errno = before;
}

/// Signals thread `tid` to drop its capabilities. Returns true if it answered, or had ended, within a second.
bool ask_thread(int tid, int signal) {
    const int before = answers.load();
    if (syscall(SYS_tgkill, getpid(), tid, signal) != 0) return errno == ESRCH;
    for (int i = 0; i < 1000 && answers.load() == before; ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return answers.load() != before;
}

/// Raises a limit to `wanted` if it is lower. Returns whether the limit is at least `wanted` now.
template<typename Resource>
bool ensure_limit(Resource resource, rlim_t wanted) noexcept {
    rlimit limit{};
    if (getrlimit(resource, &limit) != 0) return false;
    // RLIM_INFINITY is the largest rlim_t, so the comparison holds for it as well.
    if (limit.rlim_cur >= wanted) return true;
    limit.rlim_cur = wanted;
    limit.rlim_max = std::max(limit.rlim_max, wanted);
    return setrlimit(resource, &limit) == 0;
}

} // namespace

std::uint64_t replace_by_limits(int priority, int nice) noexcept {
    std::uint64_t missing = 0;
    // RLIMIT_NICE counts from 1 (nice level 19) to 40 (-20).
    if (nice < 0 && !ensure_limit(RLIMIT_NICE, static_cast<rlim_t>(20 - nice)))
        missing |= 1ULL << CAP_SYS_NICE;
    if (priority <= 0) return missing;
    if (!ensure_limit(RLIMIT_RTPRIO, static_cast<rlim_t>(priority))) missing |= 1ULL << CAP_SYS_NICE;
    if (!ensure_limit(RLIMIT_MEMLOCK, RLIM_INFINITY)) missing |= 1ULL << CAP_IPC_LOCK;
    return missing;
}

CapabilityReport drop_capabilities(std::uint64_t keep) {
    CapabilityReport report;
    CapabilitySets sets;
    // A system call filter may refuse even capget. Such a process is already confined: nothing to do.
    if (!sets.get()) return report;
    std::uint64_t permitted = 0;
    for (int half = 0; half < 2; ++half)
        permitted |= std::uint64_t{sets.halves[half].permitted | sets.halves[half].inheritable} << 32 * half;
    report.had_any = permitted != 0;
    if (!report.had_any) return report;
#ifdef __SANITIZE_THREAD__
    report.why = "ThreadSanitizer delays signals";
    return report;
#endif
    report.kept = keep & permitted;
    keep_bits = keep;
    answers = refusals = 0;
    const int signal = SIGRTMAX - 2;
    struct sigaction action {};
    action.sa_handler = on_drop_signal;
    action.sa_flags = SA_RESTART;
    if (sigaction(signal, &action, nullptr) != 0) {
        report.why = fmt::format("no signal handler: {}", std::strerror(errno));
        return report;
    }
    if (!drop_here()) {
        report.why = fmt::format("refused: {}", std::strerror(errno));
        return report;
    }
    std::set<int> done{static_cast<int>(syscall(SYS_gettid))};
    // Scan the threads until a scan finds no new one: a thread created during a scan inherited the
    // capabilities of its creator.
    std::error_code error;
    for (bool found = true; found && !error;) {
        found = false;
        for (std::filesystem::directory_iterator entry("/proc/self/task", error), end; !error && entry != end;
             entry.increment(error)) {
            const int tid = std::atoi(entry->path().filename().c_str());
            if (!done.insert(tid).second) continue;
            found = true;
            if (!ask_thread(tid, signal)) report.why = fmt::format("thread {} does not answer", tid);
        }
    }
    if (error) report.why = fmt::format("/proc/self/task: {}", error.message());
    report.threads = static_cast<int>(done.size());
    if (refusals.load() > 0) report.why = fmt::format("{} threads were refused", refusals.load());
    action.sa_handler = SIG_IGN;
    sigaction(signal, &action, nullptr);
    return report;
}

} // namespace obscura
