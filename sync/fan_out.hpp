// SPDX-License-Identifier: Apache-2.0
// Fan-out of one trigger source to several sinks, such as cameras that share a line.
#pragma once

#include "sync/sync.hpp"

#include <vector>

namespace obscura::sync {

/// Delivers each trigger to all sinks in order. The sinks must outlive the source; call add() only before the
/// source starts.
class FanOut final : public TriggerSink {
public:
    void add(TriggerSink& sink) { sinks_.push_back(&sink); }
    void on_trigger(const Trigger& trigger) noexcept override {
        for (TriggerSink* sink : sinks_)
            sink->on_trigger(trigger);
    }

private:
    std::vector<TriggerSink*> sinks_;
};

} // namespace obscura::sync
