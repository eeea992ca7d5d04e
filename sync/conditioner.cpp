// SPDX-License-Identifier: Apache-2.0
#include "sync/conditioner.hpp"

#include <cassert>

namespace obscura::sync {

Conditioner::Conditioner(const ConditionerSettings& settings, TriggerSink& next)
    : settings_(settings), next_(next) {
    assert(settings_.divider >= 1);
}

void Conditioner::on_trigger(const Trigger& trigger) noexcept {
    edges_.fetch_add(1, std::memory_order_relaxed);
    if (last_id_ != 0 && trigger.id > last_id_ + 1) {
        const std::uint64_t lost = trigger.id - last_id_ - 1;
        lost_.fetch_add(lost, std::memory_order_relaxed);
        position_ += lost;
    }
    last_id_ = trigger.id;
    // An edge earlier than the last one is not a bounce: the source's clock was set back.
    const bool first = last_edge_.ns == INT64_MIN;
    if (!first && trigger.edge >= last_edge_ && trigger.edge - last_edge_ < settings_.debounce_ns) {
        bounces_.fetch_add(1, std::memory_order_relaxed);
        return;
    }
    last_edge_ = trigger.edge;
    const std::uint64_t position = position_++;
    if (position % settings_.divider != 0) {
        divided_.fetch_add(1, std::memory_order_relaxed);
        return;
    }
    passed_.fetch_add(1, std::memory_order_relaxed);
    Trigger passed = trigger;
    passed.id = position / settings_.divider + 1;
    passed.edge += settings_.delay_ns;
    // With a divider the source does not say when the next passed edge comes.
    if (passed.next != Trigger::unknown_edge)
        passed.next = settings_.divider == 1 ? passed.next + settings_.delay_ns : Trigger::unknown_edge;
    next_.on_trigger(passed);
}

ConditionerCounters Conditioner::counters() const noexcept {
    return {edges_.load(std::memory_order_relaxed), lost_.load(std::memory_order_relaxed),
            bounces_.load(std::memory_order_relaxed), divided_.load(std::memory_order_relaxed),
            passed_.load(std::memory_order_relaxed)};
}

} // namespace obscura::sync
