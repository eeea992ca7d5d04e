// SPDX-License-Identifier: Apache-2.0
#include "emulator/trigger/alarm.hpp"

#include <algorithm>
#include <utility>

namespace obscura::emulator {

Alarm::Alarm(ThreadSettings thread, Handler handler) : handler_(std::move(handler)) {
    for (auto& due : due_ns_)
        due.store(never_ns, std::memory_order_relaxed);
    thread_ = std::thread([this, thread] {
        enter_thread(heartbeat_.name().c_str(), thread);
        declare_this_thread_realtime();
        run();
    });
}

void Alarm::stop() noexcept {
    if (!thread_.joinable()) return;
    stopping_ = true;
    changed_.notify();
    thread_.join();
}

void Alarm::set(std::size_t alarm, Time due) noexcept {
    due_ns_[alarm].store(due.ns, std::memory_order_release);
    changed_.notify();
}

void Alarm::run() noexcept {
    for (;;) {
        heartbeat_.beat();
        const std::uint32_t seen = changed_.value();
        if (stopping_) return;
        std::int64_t next_ns = never_ns;
        for (const auto& due : due_ns_)
            next_ns = std::min(next_ns, due.load(std::memory_order_acquire));
        if (const Time now = clock_.now(); next_ns > now.ns) {
            changed_.wait(seen, std::min(Time{next_ns}, now + Heartbeat::max_wait_ns));
            continue;
        }
        for (std::size_t i = 0; i < alarm_count; ++i) {
            // The exchange fails if another thread has set the alarm again meanwhile.
            std::int64_t expected = next_ns;
            if (due_ns_[i].compare_exchange_strong(expected, never_ns, std::memory_order_acq_rel))
                handler_(i, Time{next_ns});
        }
    }
}

} // namespace obscura::emulator
