// SPDX-License-Identifier: Apache-2.0
#include "sync/trigger_gate.hpp"

#include <algorithm>

namespace obscura::sync {

void TriggerGate::open() noexcept {
    wait_while(1u << phase_writing | 1u << phase_full);
    not_before_ns_ = INT64_MIN;
    for (std::atomic<std::uint64_t>& id : last_id_)
        id.store(0, std::memory_order_relaxed);
    state_.fetch_or(open_bit, std::memory_order_release);
}

void TriggerGate::close(bool and_finished) noexcept {
    state_.fetch_and(~open_bit);
    wait_while(1u << phase_writing | 1u << phase_full | (and_finished ? 1u << phase_working : 0));
    discard_latched();
}

void TriggerGate::select(std::size_t input) noexcept {
    selected_.store(input, std::memory_order_relaxed);
    for (std::atomic<std::uint64_t>& id : last_id_)
        id.store(0, std::memory_order_relaxed);
}

void TriggerGate::quit() noexcept {
    state_.fetch_or(quit_bit, std::memory_order_acq_rel);
    state_.notify_all();
}

bool TriggerGate::is_open() const noexcept {
    return (state_.load(std::memory_order_acquire) & open_bit) != 0;
}

bool TriggerGate::ready() const noexcept {
    return state_.load(std::memory_order_acquire) == (phase_ready | open_bit);
}

bool TriggerGate::ready_for(Time t) const noexcept {
    return ready() && t >= not_before();
}

bool TriggerGate::busy() const noexcept {
    return (state_.load(std::memory_order_acquire) & phase_mask) != phase_ready;
}

bool TriggerGate::offer(const Trigger& trigger, std::size_t input) noexcept {
    if (!is_open() || selected_.load(std::memory_order_relaxed) != input) {
        ignored_.fetch_add(1, std::memory_order_relaxed);
        last_id_[input].store(0, std::memory_order_relaxed);
        // Edges of inputs that are not selected come all the time.
        if (trigger.request != 0) tell_refused(trigger);
        return false;
    }
    count_lost(trigger, input);
    edges_.fetch_add(1, std::memory_order_relaxed);
    // An edge must not overtake a latched one.
    const bool alone = latch_.load(std::memory_order_acquire) == latch_empty;
    if (alone && trigger.edge.ns >= not_before_ns_.load(std::memory_order_relaxed) && try_take(trigger, 0))
        return true;
    return refuse(trigger);
}

void TriggerGate::miss(const Trigger& trigger) noexcept {
    if (!is_open()) return;
    edges_.fetch_add(1, std::memory_order_relaxed);
    miss(trigger, MissedReason::chip_busy);
}

void TriggerGate::miss(const Trigger& trigger, MissedReason reason) noexcept {
    count_missed(1, trigger.edge, reason);
    tell_refused(trigger);
}

void TriggerGate::tell_refused(const Trigger& trigger) noexcept {
    if (listener_ != nullptr) listener_->on_refused(trigger);
}

void TriggerGate::count_missed(std::uint64_t edges, Time edge, MissedReason reason) noexcept {
    missed_[static_cast<std::size_t>(reason)].fetch_add(edges, std::memory_order_relaxed);
    if (listener_ != nullptr) listener_->on_missed(edge);
}

void TriggerGate::count_lost(const Trigger& trigger, std::size_t input) noexcept {
    const std::uint64_t last = last_id_[input].exchange(trigger.id, std::memory_order_relaxed);
    if (last == 0 || trigger.id <= last + 1) return;
    lost_.fetch_add(trigger.id - last - 1, std::memory_order_relaxed);
    count_missed(trigger.id - last - 1, trigger.edge, MissedReason::lost_edge);
}

bool TriggerGate::try_take(const Trigger& trigger, std::int64_t held_ns) noexcept {
    std::uint32_t expected = phase_ready | open_bit;
    if (!state_.compare_exchange_strong(expected, phase_writing | open_bit, std::memory_order_acq_rel))
        return false;
    slot_ = trigger;
    held_ns_ = held_ns;
    taken_.fetch_add(1, std::memory_order_relaxed);
    change_phase(phase_writing, phase_full);
    return true;
}

bool TriggerGate::refuse(const Trigger& trigger) noexcept {
    const OverTrigger policy = policy_.load(std::memory_order_relaxed);
    if (policy == OverTrigger::ignore) {
        masked_.fetch_add(1, std::memory_order_relaxed);
        tell_refused(trigger);
        return false;
    }
    std::uint32_t empty = latch_empty;
    if (policy == OverTrigger::count) {
        miss(trigger, trigger.edge < not_before() ? MissedReason::chip_busy : MissedReason::rendering);
        return false;
    }
    if (!latch_.compare_exchange_strong(empty, latch_writing, std::memory_order_acq_rel)) {
        miss(trigger, MissedReason::latch_full);
        return false;
    }
    latched_trigger_ = trigger;
    latch_.exchange(latch_full);
    // Check again: the consumer may have become free, or the gate closed, before the latch was visible.
    promote_latched();
    if ((state_.load() & open_bit) == 0) return !discard_latched();
    return true;
}

void TriggerGate::promote_latched() noexcept {
    if (latch_.load(std::memory_order_acquire) != latch_full) return;
    std::uint32_t expected = phase_ready | open_bit;
    if (!state_.compare_exchange_strong(expected, phase_writing | open_bit, std::memory_order_acq_rel))
        return;
    std::uint32_t full = latch_full;
    // Another thread may have promoted or discarded the latched trigger since the check above.
    if (latch_.compare_exchange_strong(full, latch_writing, std::memory_order_acq_rel)) {
        slot_ = latched_trigger_;
        held_ns_ = std::max<std::int64_t>(0, not_before_ns_.load(std::memory_order_relaxed) -
                                                 latched_trigger_.edge.ns);
        latch_.store(latch_empty, std::memory_order_release);
        taken_.fetch_add(1, std::memory_order_relaxed);
        latched_.fetch_add(1, std::memory_order_relaxed);
        change_phase(phase_writing, phase_full);
    } else {
        change_phase(phase_writing, phase_ready);
    }
}

bool TriggerGate::discard_latched() noexcept {
    // Hold the latch while it is read, so that no other edge overwrites it.
    std::uint32_t full = latch_full;
    if (!latch_.compare_exchange_strong(full, latch_writing)) return false;
    const Trigger trigger = latched_trigger_;
    latch_.exchange(latch_empty);
    miss(trigger, MissedReason::stopped);
    return true;
}

bool TriggerGate::wait() noexcept {
    for (;;) {
        const std::uint32_t state = state_.load(std::memory_order_acquire);
        if ((state & phase_mask) == phase_full) return true;
        if ((state & quit_bit) != 0) return false;
        state_.wait(state, std::memory_order_acquire);
    }
}

bool TriggerGate::pending() const noexcept {
    return (state_.load(std::memory_order_acquire) & phase_mask) == phase_full;
}

void TriggerGate::close_after_this() noexcept {
    state_.fetch_and(~open_bit);
    discard_latched();
}

void TriggerGate::started(Time not_before) noexcept {
    not_before_ns_.store(not_before.ns, std::memory_order_relaxed);
    change_phase(phase_full, phase_working);
}

void TriggerGate::finished() noexcept {
    const std::uint32_t phase = state_.load(std::memory_order_relaxed) & phase_mask;
    change_phase(phase, phase_ready);
    promote_latched();
}

GateCounters TriggerGate::counters() const noexcept {
    GateCounters c;
    c.edges = edges_.load(std::memory_order_relaxed);
    c.lost = lost_.load(std::memory_order_relaxed);
    c.taken = taken_.load(std::memory_order_relaxed);
    c.masked = masked_.load(std::memory_order_relaxed);
    c.latched = latched_.load(std::memory_order_relaxed);
    c.ignored = ignored_.load(std::memory_order_relaxed);
    for (std::size_t reason = 0; reason < missed_.size(); ++reason)
        c.missed += c.missed_because[reason] = missed_[reason].load(std::memory_order_relaxed);
    return c;
}

void TriggerGate::change_phase(std::uint32_t from, std::uint32_t to) noexcept {
    state_.fetch_xor(from ^ to, std::memory_order_acq_rel);
    state_.notify_all();
}

void TriggerGate::wait_while(std::uint32_t phases) const noexcept {
    for (;;) {
        const std::uint32_t state = state_.load(std::memory_order_acquire);
        if ((phases >> (state & phase_mask) & 1u) == 0) return;
        state_.wait(state, std::memory_order_acquire);
    }
}

} // namespace obscura::sync
