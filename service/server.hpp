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

#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
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

    /// One more way in, before run().
    void add(ListeningEndpoint endpoint);
    /// The native protocol at one more socket, before run(), for clients that may do what `most` permits and
    /// prove nothing; they have places of their own, for which further ones wait.
    void add_for(Permission most, Listener listener, const OwnPlaces& places);
    /// What all clients hold together.
    [[nodiscard]] MemoryAccount& memory() noexcept { return memory_; }
    /// Serves until `stopped` returns true, which is asked five times a second and after each signal.
    void run(const std::function<bool()>& stopped);

private:
    using Clock = Peer::Clock;
    struct Endpoint {
        Acceptor acceptor;
        decltype(ListeningEndpoint::open) open;
        OwnPlaces places;
    };
    struct Client {
        std::unique_ptr<Peer> peer;
        const Endpoint* endpoint;
    };
    using Clients = std::vector<Client>;

    /// Clients that count for the places of `endpoint`.
    [[nodiscard]] std::size_t count(const Clients& clients, const Endpoint& endpoint) const;
    [[nodiscard]] std::size_t places_of(const Endpoint& endpoint) const;
    /// The client of `endpoint` that may be ended now for another one; the end: none may.
    [[nodiscard]] Clients::iterator longest_silent(const Endpoint& endpoint, Clock::time_point now);
    /// Whether there is a place for one more; ends another client where that makes one soon.
    [[nodiscard]] bool make_place(const Endpoint& endpoint, Clock::time_point now);
    void open(const Endpoint& endpoint, FileDescriptor client);
    [[nodiscard]] ListeningEndpoint native(Listener listener, AcceptRules rules, const OwnPlaces& places,
                                           std::function<Access(int client)> access);
    [[nodiscard]] Access access_of(bool is_unix, int client);
    void reap_closed_connections();

    const Limits limits_;
    std::deque<Endpoint> endpoints_; ///< clients refer to them
    Tokens tokens_;
    const std::optional<gid_t> admin_group_;
    MemoryAccount memory_{limits_.memory_bytes};
    ConnectionContext context_;
    FileDescriptor wakeup_fd_; ///< eventfd: a connection has something to send
    Clients connections_;
    Clients closed_; ///< their calls have not ended yet
};

} // namespace obscura::service
