// SPDX-License-Identifier: Apache-2.0
// A camera as the calls of control clients see it.
#pragma once

#include "core/clock.hpp"
#include "emulator/camera/camera.hpp"
#include "transports/transport.hpp"

#include <functional>
#include <memory>
#include <string>

namespace obscura::transports {
class DeviceFeatures;
class FaultRules;
struct KeptFrame;
class WatchTransport;
} // namespace obscura::transports

namespace obscura::emulator {

struct FrameOverlay;
class RecentTiming;
class SimulatorServer;

/// All members outlive the calls.
struct ControlledCamera {
    Camera& camera;
    const Clock& clock;
    /// Runs work while no other thread changes the camera's settings, see Transport::run_between_commands().
    std::function<void(const transports::Transport::ControlWork&)> run;
    SimulatorServer* simulator = nullptr;        ///< null: no poses and steps are taken
    transports::WatchTransport* watch = nullptr; ///< null: no frames are to be had
    transports::FaultRules* faults = nullptr;    ///< null: no transport injects faults
    const RecentTiming* timing = nullptr;        ///< null: no time stamps are to be had
    /// Daemon::config_sha256(); empty: not known.
    std::function<std::string()> config_sha256{};
    transports::DeviceFeatures* device = nullptr; ///< null: no transport has features of its own
    /// Where things are in a frame that was looked at; null: its scene has been replaced since. Throws
    /// ConfigError. Empty: not known.
    std::function<std::shared_ptr<const FrameOverlay>(const transports::KeptFrame&)> overlay{};
};

} // namespace obscura::emulator
