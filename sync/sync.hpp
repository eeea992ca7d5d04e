// Read this first: trigger sources turn an outside clock into Triggers.
#pragma once

#include "core/clock_state.hpp"
#include "core/heartbeat.hpp"
#include "core/time.hpp"

#include <cstdint>
#include <string_view>

namespace obscura::sync {

/// One edge of the bench's clock.
struct Trigger {
    std::uint64_t id = 0; ///< counts from 1 per source, gaps mean lost edges
    Time edge;            ///< the edge's own stamp (scheduled instant, kernel stamp), never "now"
    Time seen;            ///< when user space learnt of it
    ClockState clock = ClockState::free; ///< of the source when it saw the edge
    /// Lockstep: what the scene's clock shows at the edge; otherwise scene_of_camera, and the camera decides.
    Time scene = scene_of_camera;
    bool falling = false;      ///< of sources that tell edges apart
    std::int64_t width_ns = 0; ///< from the edge to the end of its pulse, where that was waited for; else 0

    static constexpr Time scene_of_camera{INT64_MIN};
};

/// Receives triggers. Implemented by the emulator.
class TriggerSink {
public:
    virtual ~TriggerSink() = default;
    /// Called on the source's thread, which may be real-time: must not block, allocate, lock, log or throw.
    virtual void on_trigger(const Trigger& trigger) noexcept = 0;
};

/// A source of triggers with a thread of its own. One file pair per kind of source, and one line in the
/// registry that makes it from its configuration.
class TriggerSource {
public:
    virtual ~TriggerSource() = default; ///< stops first if need be
    [[nodiscard]] virtual std::string_view name() const = 0;
    /// Starts delivering to `sink`, which must outlive stop(). Throws HardwareError.
    virtual void start(TriggerSink& sink) = 0;
    /// After the return no further trigger is delivered.
    virtual void stop() = 0;
    /// How far its clock can be trusted at `now` (scheduling clock). Any thread.
    [[nodiscard]] virtual ClockState clock_state(Time /*now*/) const noexcept { return ClockState::free; }
    /// Of its threads. They outlive stop().
    [[nodiscard]] virtual Heartbeats heartbeats() const { return {}; }
};

} // namespace obscura::sync
