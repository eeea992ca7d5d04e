// SPDX-License-Identifier: Apache-2.0
// Throttle of real-time render threads, so that SCHED_OTHER tasks are not starved.
#pragma once

#include "core/time.hpp"

#include <cstdint>

namespace obscura::emulator {

/// How long a thread of class rr or fifo has to sleep so that it is at work no more than `share` of its time.
/// Linux takes 50 ms of each second of a core from all real-time threads, those that release rows among them,
/// once ordinary programs had none of it (fair server, from 6.12 on) or real-time threads had more than
/// sched_rt_runtime_us of it (before): rows leave up to 50 ms late. Nothing is taken from threads that leave
/// as much in small pieces. Thread-bound.
class RenderRest {
public:
    explicit RenderRest(double share) noexcept : share_(share) {}

    /// Nanoseconds to sleep at `now`, before the next row; 0: none. `first`: the thread has been waiting for
    /// work since the last call, which counts as rest.
    [[nodiscard]] std::int64_t owed(Time now, bool first) noexcept;
    /// The thread has slept since the last owed().
    void slept(Time now) noexcept;

    static constexpr std::int64_t min_rest_ns = ns_per_ms;     ///< shorter rests are put together
    static constexpr std::int64_t max_rest_ns = 2 * ns_per_ms; ///< longer ones are taken in pieces

private:
    static constexpr double credit_for_ns = 100e6; ///< of work: waiting counts for no more
    static constexpr double max_debt_ns = 20e6;

    double share_;
    double balance_ns_ = 0; ///< of rest that is owed; negative: waited ahead
    Time last_;             ///< the last call
};

/// Lets the calling thread, which renders, rest as RenderRest says. Real-time safe.
void rest_before_row(double share, bool first) noexcept;

} // namespace obscura::emulator
