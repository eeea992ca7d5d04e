// SPDX-License-Identifier: Apache-2.0
#include "sync/software.hpp"

namespace obscura::sync {

void SoftwareTrigger::start(TriggerSink& sink) {
    const std::lock_guard lock(mutex_);
    sink_ = &sink;
    next_id_ = 1;
}

void SoftwareTrigger::stop() {
    const std::lock_guard lock(mutex_);
    sink_ = nullptr;
}

bool SoftwareTrigger::fire(Time edge, Time scene, std::uint64_t request) {
    const std::lock_guard lock(mutex_);
    if (sink_ == nullptr) return false;
    const ClockState state = scene == Trigger::scene_of_camera ? ClockState::free : ClockState::locked;
    state_.store(state, std::memory_order_relaxed);
    Trigger trigger{next_id_++, edge, clock_.now(), state, scene};
    trigger.request = request;
    sink_->on_trigger(trigger);
    return true;
}

} // namespace obscura::sync
