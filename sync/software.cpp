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

bool SoftwareTrigger::fire(Time edge) {
    const std::lock_guard lock(mutex_);
    if (sink_ == nullptr) return false;
    sink_->on_trigger({next_id_++, edge, clock_.now()});
    return true;
}

} // namespace obscura::sync
