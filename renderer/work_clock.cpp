// SPDX-License-Identifier: Apache-2.0
#include "renderer/work_clock.hpp"

#include "core/time.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#if defined(__x86_64__)
#include <x86intrin.h>
#endif

namespace obscura::renderer {
namespace {

std::int64_t steady_ns() noexcept {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(
               std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

struct ThreadUse {
    std::int64_t cpu_ns = 0;
    std::uint64_t preemptions = 0, page_faults = 0;
};

ThreadUse thread_use() noexcept {
    rusage use{};
    if (getrusage(RUSAGE_THREAD, &use) != 0) return {};
    const auto ns = [](const timeval& t) {
        return static_cast<std::int64_t>(t.tv_sec) * ns_per_s +
               static_cast<std::int64_t>(t.tv_usec) * ns_per_us;
    };
    return {ns(use.ru_utime) + ns(use.ru_stime), static_cast<std::uint64_t>(use.ru_nivcsw),
            static_cast<std::uint64_t>(use.ru_majflt)};
}

} // namespace

void WorkTotals::add(const RenderWork& work) noexcept {
    for (std::size_t i = 0; i < render_part_count; ++i)
        if (work.part_ns[i] != 0) part_ns_[i].fetch_add(work.part_ns[i], std::memory_order_relaxed);
    measured_ns_.fetch_add(work.measured_ns, std::memory_order_relaxed);
    measured_cpu_ns_.fetch_add(work.measured_cpu_ns, std::memory_order_relaxed);
    preemptions_.fetch_add(work.preemptions, std::memory_order_relaxed);
    page_faults_.fetch_add(work.page_faults, std::memory_order_relaxed);
    rows_.fetch_add(work.rows, std::memory_order_relaxed);
    instants_.fetch_add(work.instants, std::memory_order_relaxed);
}

RenderWork WorkTotals::read() const noexcept {
    RenderWork work;
    for (std::size_t i = 0; i < render_part_count; ++i)
        work.part_ns[i] = part_ns_[i].load(std::memory_order_relaxed);
    work.measured_ns = measured_ns_.load(std::memory_order_relaxed);
    work.measured_cpu_ns = measured_cpu_ns_.load(std::memory_order_relaxed);
    work.preemptions = preemptions_.load(std::memory_order_relaxed);
    work.page_faults = page_faults_.load(std::memory_order_relaxed);
    work.rows = rows_.load(std::memory_order_relaxed);
    work.instants = instants_.load(std::memory_order_relaxed);
    return work;
}

std::uint64_t WorkClock::ticks() noexcept {
#if defined(__x86_64__)
    return __rdtsc();
#else
    return static_cast<std::uint64_t>(steady_ns());
#endif
}

void WorkClock::start(RenderPart whole) noexcept {
    whole_ = whole;
    part_ticks_ = {};
    rows_ = instants_ = 0;
    begin_ns_ = steady_ns();
    measured_ = begin_ns_ - last_measured_ns_ >= ns_per_ms;
    if (measured_) {
        const ThreadUse use = thread_use();
        cpu_begin_ns_ = use.cpu_ns;
        if (last_measured_ns_ == 0) {
            preemptions_ = use.preemptions;
            page_faults_ = use.page_faults;
        }
    }
    first_ = last_ = ticks();
}

void WorkClock::stop(WorkTotals& totals) noexcept {
    const std::uint64_t end = ticks();
    RenderWork work;
    const std::int64_t now = steady_ns();
    const auto elapsed_ticks = static_cast<double>(end - first_);
    // The rate of the counter, by the clock over this run.
    const double ns_per_tick = elapsed_ticks > 0 ? static_cast<double>(now - begin_ns_) / elapsed_ticks : 0;
    for (std::size_t i = 0; i < render_part_count; ++i)
        work.part_ns[i] = std::llround(static_cast<double>(part_ticks_[i]) * ns_per_tick);
    if (measured_) {
        const ThreadUse use = thread_use();
        last_measured_ns_ = steady_ns();
        work.measured_ns = last_measured_ns_ - begin_ns_;
        work.measured_cpu_ns = std::clamp<std::int64_t>(use.cpu_ns - cpu_begin_ns_, 0, work.measured_ns);
        // All since the last look: a thread without work is not preempted.
        work.preemptions = use.preemptions - std::exchange(preemptions_, use.preemptions);
        work.page_faults = use.page_faults - std::exchange(page_faults_, use.page_faults);
    }
    work.rows = rows_;
    work.instants = instants_;
    totals.add(work);
}

} // namespace obscura::renderer
