// SPDX-License-Identifier: Apache-2.0
// Inputs of the trigger gate: one per SFNC TriggerSource, and the free-run timer.
#pragma once

#include "core/camera/camera.hpp"
#include "core/camera/trigger.hpp"
#include "sync/trigger_gate.hpp"

#include <cstddef>

namespace obscura::emulator {

/// Input number of the trigger gate. Each route has one calling thread.
using TriggerRoute = std::size_t;
constexpr TriggerRoute free_run_route = trigger_source_count;
static_assert(free_run_route < sync::TriggerGate::input_count);

[[nodiscard]] constexpr TriggerRoute route_of(TriggerSource source) noexcept {
    return static_cast<TriggerRoute>(source);
}
/// The route whose edges become frames.
[[nodiscard]] constexpr TriggerRoute route_of(const CameraSettings& s) noexcept {
    if (s.exposure_trigger.enabled) return route_of(s.exposure_trigger.source);
    return s.frame_trigger.enabled ? route_of(s.frame_trigger.source) : free_run_route;
}

} // namespace obscura::emulator
