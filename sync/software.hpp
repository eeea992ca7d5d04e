// A trigger source that fires when it is told to.
#pragma once

#include "core/clock.hpp"
#include "sync/sync.hpp"

#include <cstdint>
#include <mutex>

namespace obscura::sync {

/// Delivers a trigger on the calling thread for every fire(). For control ports, tests and lockstep.
class SoftwareTrigger final : public TriggerSource {
public:
    /// `clock` is used for the `seen` stamp and must outlive the source.
    explicit SoftwareTrigger(const Clock& clock) : clock_(clock) {}

    [[nodiscard]] std::string_view name() const override { return "software"; }
    void start(TriggerSink& sink) override;
    void stop() override;

    /// Delivers a trigger whose edge is `edge`; false when the source is not started. Any ordinary thread.
    bool fire(Time edge);

private:
    const Clock& clock_;
    std::mutex mutex_;
    TriggerSink* sink_ = nullptr;
    std::uint64_t next_id_ = 1;
};

} // namespace obscura::sync
