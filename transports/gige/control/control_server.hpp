// SPDX-License-Identifier: Apache-2.0
// GVCP server: control thread with the sockets of one interface and the heartbeat timer.
#pragma once

#include "core/clock.hpp"
#include "core/io/file_descriptor.hpp"
#include "core/realtime/heartbeat.hpp"
#include "core/realtime/realtime.hpp"
#include "core/realtime/work_queue.hpp"
#include "transports/gige/control/control_port.hpp"

#include <array>
#include <functional>
#include <thread>

namespace obscura::transports::gige {

/// Control thread. Has three sockets (the interface's address, 255.255.255.255, the subnet's broadcast
/// address), so that several cameras can share a host and each receives only its own requests and broadcasts.
class ControlServer {
public:
    ControlServer(ControlPort& port, const NetworkInterface& network, const Clock& clock, int udp_port,
                  const ThreadSettings& thread);
    ~ControlServer() { stop(); }
    ControlServer(const ControlServer&) = delete;
    ControlServer& operator=(const ControlServer&) = delete;

    /// Throws HardwareError when the port cannot be bound.
    void start();
    /// Joins the thread; a controller loses control.
    void stop();
    /// Makes the controller, if any, lose control soon. Thread-safe between start() and stop().
    void release_control();
    /// Runs `work` on the control thread between two commands and returns once it has run. False: the server
    /// is not started. Thread-safe; not on the control thread.
    bool run(const std::function<void()>& work);
    /// Control thread: announces a write to a disk, which may be slow and is no hung thread.
    void announce_disk() noexcept;
    [[nodiscard]] const Heartbeat& heartbeat() const noexcept { return heartbeat_; }

private:
    void loop();
    void serve(int fd, bool broadcast);
    void arm_heartbeat();
    static void signal(const FileDescriptor& event);

    ControlPort& port_;
    const NetworkInterface network_;
    const Clock& clock_;
    const int udp_port_;
    const ThreadSettings thread_settings_;
    std::array<FileDescriptor, 3> sockets_; // unicast, limited broadcast, subnet broadcast
    FileDescriptor epoll_, timer_, stop_event_, release_event_, work_event_;
    WorkQueue work_;
    Time armed_{INT64_MAX};
    Heartbeat heartbeat_{"gige-control"};
    std::thread thread_;
};

} // namespace obscura::transports::gige
