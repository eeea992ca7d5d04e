// SPDX-License-Identifier: Apache-2.0
// Trigger sources: conversion of external clocks and edges to Triggers. Read this header first.
#pragma once

#include "core/clock_state.hpp"
#include "core/realtime/heartbeat.hpp"
#include "core/time.hpp"

#include <cstdint>
#include <string_view>

namespace obscura::sync {

/// One edge of a trigger source.
struct Trigger {
    std::uint64_t id = 0; ///< counts from 1 per source, gaps mean lost edges
    /// The edge's own time stamp (scheduled instant, kernel stamp), never "now".
    Time edge;
    Time seen;                           ///< when user space received it
    ClockState clock = ClockState::free; ///< of the source when it saw the edge
    /// Lockstep: scene time at the edge; otherwise scene_of_camera, and the camera computes it.
    Time scene = scene_of_camera;
    bool falling = false; ///< only from sources that distinguish edges
    /// From the edge to the end of its pulse, if that was awaited; else 0.
    std::int64_t width_ns = 0;

    /// The edge that the source delivers next, if its schedule says so; otherwise unknown_edge.
    Time next = unknown_edge;
    /// Number by which a waiting caller knows the edge's outcome; 0: no caller waits.
    std::uint64_t request = 0;

    static constexpr Time scene_of_camera{INT64_MIN};
    static constexpr Time unknown_edge{INT64_MIN};
};

/// Receives triggers. Implemented by the emulator.
class TriggerSink {
public:
    virtual ~TriggerSink() = default;
    /// Called on the source's thread, which may be real-time: must not block, allocate, lock, log or throw.
    virtual void on_trigger(const Trigger& trigger) noexcept = 0;
};

/// A source of triggers with its own thread. One file pair per kind of source, and one line in the registry
/// that makes it from its configuration.
class TriggerSource {
public:
    virtual ~TriggerSource() = default; ///< stops the source if it is running
    [[nodiscard]] virtual std::string_view name() const = 0;
    /// Starts delivering to `sink`, which must outlive stop(). Throws HardwareError.
    virtual void start(TriggerSink& sink) = 0;
    /// Stops the source. After the return no further trigger is delivered.
    virtual void stop() = 0;
    /// Synchronisation state of its clock at `now` (scheduling clock). Thread-safe.
    [[nodiscard]] virtual ClockState clock_state(Time /*now*/) const noexcept { return ClockState::free; }
    /// What arrived since start() and was no trigger: it is dropped. Thread-safe.
    [[nodiscard]] virtual std::uint64_t refused() const noexcept { return 0; }
    /// Heartbeats of its threads. They outlive stop().
    [[nodiscard]] virtual Heartbeats heartbeats() const { return {}; }
};

} // namespace obscura::sync
