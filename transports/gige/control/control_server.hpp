// SPDX-License-Identifier: Apache-2.0
// The control thread: sockets for GVCP on one interface, and the heartbeat timer.
#pragma once

#include "core/clock.hpp"
#include "core/file_descriptor.hpp"
#include "core/heartbeat.hpp"
#include "core/realtime.hpp"
#include "transports/gige/control/control_port.hpp"

#include <array>
#include <thread>

namespace obscura::transports::gige {

/// Three sockets (the interface's address, 255.255.255.255, the subnet's broadcast address), so that several
/// cameras can share a host and each hears only what is for it or for everybody.
class ControlServer {
public:
    ControlServer(ControlPort& port, const NetworkInterface& network, const Clock& clock, int udp_port,
                  const ThreadSettings& thread);
    ~ControlServer() { stop(); }
    ControlServer(const ControlServer&) = delete;
    ControlServer& operator=(const ControlServer&) = delete;

    /// Throws HardwareError when the port cannot be had.
    void start();
    /// Joins the thread; the controller, if any, loses control first.
    void stop();
    [[nodiscard]] const Heartbeat& heartbeat() const noexcept { return heartbeat_; }

private:
    void loop();
    void serve(int fd, bool broadcast);
    void arm_heartbeat();

    ControlPort& port_;
    const NetworkInterface network_;
    const Clock& clock_;
    const int udp_port_;
    const ThreadSettings thread_settings_;
    std::array<FileDescriptor, 3> sockets_; // unicast, limited broadcast, subnet broadcast
    FileDescriptor epoll_, timer_, stop_event_;
    Time armed_{INT64_MAX};
    Heartbeat heartbeat_{"gige-control"};
    std::thread thread_;
};

} // namespace obscura::transports::gige
