// SPDX-License-Identifier: Apache-2.0
// Server: one thread that receives and sends for all connections, whatever they speak.
#pragma once

#include "service/connection.hpp"
#include "service/limits.hpp"
#include "service/listener.hpp"
#include "service/memory_account.hpp"
#include "service/peer.hpp"
#include "service/session.hpp"
#include "service/tokens.hpp"

#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace obscura::service {

/// Accepts clients up to the limit, refuses further ones with an error message, and serves all until it is
/// stopped. Thread-bound; calls run on threads of their connections.
class Server {
public:
    /// The native protocol at `listeners`. `host` outlives this. Clients over TCP need one of `tokens` if
    /// there are any, and else may do what Permission::scene allows; over Unix sockets see
    /// permission_of_peer(), for which `admin_group` is meant.
    Server(const Limits& limits, Host& host, std::vector<Listener> listeners, Tokens tokens = {},
           std::optional<gid_t> admin_group = {});
    /// Cancels what is in progress and waits for it.
    ~Server();
    Server(const Server&) = delete;
    Server& operator=(const Server&) = delete;

    /// One more way in, before run(); its clients count as all others.
    void add(ListeningEndpoint endpoint) { endpoints_.push_back(std::move(endpoint)); }
    /// What all clients hold together.
    [[nodiscard]] MemoryAccount& memory() noexcept { return memory_; }
    /// Serves until `stopped` returns true, which is asked five times a second and after each signal.
    void run(const std::function<bool()>& stopped);

private:
    /// False: there was no descriptor, or no memory, for a client that waits.
    [[nodiscard]] bool accept(const ListeningEndpoint& endpoint);
    void open(const ListeningEndpoint& endpoint, FileDescriptor client);
    [[nodiscard]] Access access_of(bool is_unix, int client);
    void reap_closed_connections();

    const Limits limits_;
    std::vector<ListeningEndpoint> endpoints_;
    Tokens tokens_;
    const std::optional<gid_t> admin_group_;
    MemoryAccount memory_{limits_.memory_bytes};
    const ConnectionContext context_;
    FileDescriptor wakeup_fd_; ///< eventfd: a connection has something to send
    std::vector<std::unique_ptr<Peer>> connections_;
    std::vector<std::unique_ptr<Peer>> closed_; ///< their calls have not ended yet
    Peer::Clock::time_point accept_from_{};     ///< until then no client is accepted: none could be
};

} // namespace obscura::service
