// SPDX-License-Identifier: Apache-2.0
// SCPI over TCP ("raw socket"): listening ports, and a thread for each client.
#pragma once

#include "core/io/file_descriptor.hpp"
#include "instrument/link/admission.hpp"
#include "instrument/link/daemon_link.hpp"
#include "instrument/scpi/commands.hpp"
#include "service/acceptor.hpp"

#include <atomic>
#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace obscura::instrument {

/// What the server grants.
struct ScpiLimits {
    std::size_t read_only = 6;             ///< of the clients: those of ports for queries only
    std::size_t clients = 8;               ///< at a time, over all ports
    std::size_t line_bytes = 4096;         ///< of a message; longer ones are thrown away and reported
    std::size_t thrown_away_bytes = 65536; ///< of such a line, after which the connection ends
    /// Time without a byte of a client, after which it makes room for another one.
    service::IdleRules idle{.idle = std::chrono::hours(1)};
    std::chrono::seconds unread{10}; ///< that an answer waits for the client to read it
};

/// A listening port and what its clients may do.
struct ScpiPort {
    service::Listener listener;
    bool may_change = false;
};

/// Thread-bound.
class ScpiServer {
public:
    /// `version`: of this program. `admission` outlives this.
    ScpiServer(const ScpiLimits& limits, DaemonAddress daemon, std::string version,
               std::vector<ScpiPort> ports, const Admission& admission);
    /// Ends all clients, after at most the longest silence of a daemon.
    ~ScpiServer();
    ScpiServer(const ScpiServer&) = delete;
    ScpiServer& operator=(const ScpiServer&) = delete;

    /// Serves until `stopped` returns true, which is asked five times a second.
    void run(const std::function<bool()>& stopped);

private:
    using Clock = std::chrono::steady_clock;
    struct Client {
        FileDescriptor socket;
        bool may_change = false;
        std::atomic<Clock::time_point> heard{Clock::now()}; ///< when its last bytes came
        std::atomic<bool> done{false};
        std::thread thread;
    };
    /// A listening port.
    struct Port {
        service::Acceptor acceptor;
        bool may_change = false;
    };
    /// Whether there is a place for a client of that port; ends a silent one where that makes one.
    [[nodiscard]] bool make_place(const Port& port);
    void open(const Port& port, FileDescriptor socket);
    void serve(Client& client) const;
    /// Ends the client that has been silent for longest, if that is longer than the limit.
    /// `of_read_only`: one that may not change cameras.
    void make_room(bool of_read_only);
    [[nodiscard]] std::size_t read_only_clients() const;
    /// Joins the clients that are done, or all.
    void reap_closed_clients(bool all);

    const ScpiLimits limits_;
    const DaemonAddress daemon_;
    const std::string version_;
    const CommandTable table_;
    std::vector<Port> ports_;
    std::atomic<bool> ending_{false};
    std::vector<std::unique_ptr<Client>> clients_;
};

} // namespace obscura::instrument
