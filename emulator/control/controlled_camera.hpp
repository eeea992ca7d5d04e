// SPDX-License-Identifier: Apache-2.0
// A camera as the calls of control clients see it.
#pragma once

#include "core/clock.hpp"
#include "core/file_descriptor.hpp"
#include "emulator/camera.hpp"
#include "transports/transport.hpp"

#include <atomic>
#include <functional>

namespace obscura::transports {
class FaultRules;
class WatchTransport;
} // namespace obscura::transports

namespace obscura::emulator {

class RecentTiming;

/// All members outlive the calls.
struct ControlledCamera {
    Camera& camera;
    const Clock& clock;
    /// Runs work where nobody else changes the camera's settings, see Transport::run_between_commands().
    std::function<void(const transports::Transport::ControlWork&)> run;
    /// Connects to the simulator port; empty: there is none.
    std::function<FileDescriptor()> connect_to_simulator;
    transports::WatchTransport* watch = nullptr; ///< null: no frames are to be had
    transports::FaultRules* faults = nullptr;    ///< null: no transport injects faults
    const RecentTiming* timing = nullptr;        ///< null: no time stamps are to be had
    /// A trigger of a client is in progress. Counters tell the outcome of one at a time.
    std::atomic<bool> triggering{false};
};

} // namespace obscura::emulator
