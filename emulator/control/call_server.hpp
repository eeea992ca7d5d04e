// SPDX-License-Identifier: Apache-2.0
// Server of the native protocol in a daemon: the calls of its clients reach the running cameras.
#pragma once

#include "emulator/control/control_host.hpp"
#include "service/server.hpp"

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace obscura::emulator {

class Daemon;
class Monitor;

/// Has a thread, and one for each client, of ordinary scheduling and low priority, on cores that no thread
/// with a real-time priority has been given, if there are any. Nothing here waits for a real-time thread, or
/// such a thread for it: what changes a camera goes to its control thread. Thread-bound to the main thread.
class CallServer {
public:
    /// `daemon` and `monitor` outlive this. Opens nothing.
    CallServer(Daemon& daemon, Monitor& monitor, const std::string& version);
    ~CallServer();
    CallServer(const CallServer&) = delete;
    CallServer& operator=(const CallServer&) = delete;

    /// Opens the sockets of [control] and [monitor], if there are any, and serves. After Daemon::start().
    /// Throws HardwareError.
    void start();
    /// To be called several times a second.
    void tick() { host_.tick(); }
    /// Loads the scene, or takes on the values, that a client has asked for, if any, see SceneRequests. To be
    /// called several times a second, not within Daemon::reload().
    void serve_requests(const SceneRequests::Load& load, const SceneRequests::Change& change) {
        host_.scene_requests().serve(load, change);
    }
    /// Ends all connections, before Daemon::stop().
    void stop();

    /// Where [control] has it listen.
    [[nodiscard]] const std::vector<std::string>& addresses() const noexcept { return addresses_; }

private:
    Daemon& daemon_;
    Monitor& monitor_;
    ControlHost host_;
    std::unique_ptr<service::Server> server_;
    std::vector<std::string> addresses_;
    std::atomic<bool> stopping_{false};
    std::thread thread_;
};

} // namespace obscura::emulator
