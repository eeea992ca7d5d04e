// SPDX-License-Identifier: Apache-2.0
// Server of the native protocol in a daemon: the calls of its clients reach the running cameras.
#pragma once

#include "core/time.hpp"
#include "emulator/config/daemon_config.hpp"
#include "emulator/control/control_host.hpp"
#include "emulator/control/starting_host.hpp"
#include "service/server.hpp"

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
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
    /// `config` and `progress` outlive this. Opens nothing.
    CallServer(const DaemonConfig& config, const StartProgress& progress, const std::string& version);
    ~CallServer();
    CallServer(const CallServer&) = delete;
    CallServer& operator=(const CallServer&) = delete;

    /// Opens the sockets of [control] and [monitor], if there are any, and serves: the state and the log,
    /// while all else is refused until start(). Throws HardwareError.
    void open();
    /// Runs `work` while no thread of this starts another one.
    void pause_for(const std::function<void()>& work);
    /// After Daemon::start(): serves its cameras. Both outlive this.
    void start(Daemon& daemon, Monitor& monitor);
    /// To be called several times a second, after start().
    void tick() { host_->tick(); }
    /// Loads the scene, or takes on the values, that a client has asked for, if any, see SceneRequests. To be
    /// called several times a second, after start(), not within Daemon::reload().
    void serve_requests(const SceneRequests::Load& load, const SceneRequests::Change& change) {
        host_->scene_requests().serve(load, change);
    }
    /// Ends all connections, before Daemon::stop().
    void stop();

    /// Where [control] has it listen.
    [[nodiscard]] const std::vector<std::string>& addresses() const noexcept { return addresses_; }

private:
    [[nodiscard]] bool stopped();

    const DaemonConfig& config_;
    const StartProgress& progress_;
    const std::string version_;
    const Time started_;
    const std::int64_t started_utc_ns_;
    std::unique_ptr<ControlHost> host_; ///< null before start()
    std::unique_ptr<StartingHost> starting_;
    std::unique_ptr<service::Server> server_;
    std::vector<std::string> addresses_;
    std::atomic<bool> stopping_{false};
    std::mutex pausing_; ///< the server's thread holds it unless it stands in stopped()
    std::atomic<bool> pause_{false};
    std::optional<CoreSet> cores_; ///< that the server's thread is to go to; under pausing_
    std::thread thread_;
};

} // namespace obscura::emulator
