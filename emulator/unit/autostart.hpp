// SPDX-License-Identifier: Apache-2.0
// Acquisition that begins with the daemon (daemon.autostart) and makes way for clients of the control port.
#pragma once

#include "core/camera/camera.hpp"
#include "transports/control_listener.hpp"

#include <mutex>
#include <string>

namespace obscura::emulator {

/// Runs the camera's acquisition between begin() and end() while no client has control. `camera` must outlive
/// it. Thread-safe.
class Autostart final : public transports::ControlListener {
public:
    explicit Autostart(CameraControl& camera) : camera_(camera) {}

    /// `address`: of the control port, for messages.
    void begin(const std::string& address);
    /// Starts no acquisition any more; one that runs goes on.
    void end();

    void control_taken(const std::string& client) override;
    void control_ended(const std::string& why) override;

private:
    void give_way();

    CameraControl& camera_;
    std::mutex mutex_;
    bool begun_ = false;
    std::string address_;
    std::string client_; ///< in control; empty: none
};

} // namespace obscura::emulator
