// SPDX-License-Identifier: Apache-2.0
#include "service/server.hpp"

#include "core/error.hpp"
#include "service/failure.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <exception>
#include <iterator>
#include <utility>

namespace obscura::service {
namespace {

constexpr int poll_interval_ms = 200;
/// While calls of connections that have ended go on: these count as clients.
constexpr int reap_interval_ms = 5;
} // namespace

Server::Server(const Limits& limits, Host& host, std::vector<Listener> listeners, Tokens tokens,
               std::optional<gid_t> admin_group)
    : limits_(limits),
      tokens_(std::move(tokens)),
      admin_group_(admin_group),
      context_{limits_, host, memory_, {}},
      wakeup_fd_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    if (!wakeup_fd_) throw HardwareError(fmt::format("eventfd: {}", std::strerror(errno)));
    for (Listener& listener : listeners) {
        const bool is_unix = listener.is_unix(); // no more once it has moved
        const std::size_t places = limits.clients + (is_unix ? limits.local_clients : 0);
        const Outgoing refusal = make_message(
            MessageKind::error, 0,
            {{"code", name_of(FailureCode::busy)},
             {"message", fmt::format("{} clients are connected already, allowed {}", places, places)}});
        add(native(std::move(listener), {.refusal = refusal.start}, {},
                   [this, is_unix](int client) { return access_of(is_unix, client); }));
    }
}

void Server::add(ListeningEndpoint endpoint) {
    endpoints_.push_back({Acceptor(std::move(endpoint.listener), std::move(endpoint.rules)),
                          std::move(endpoint.open), endpoint.places});
}

void Server::add_for(Permission most, Listener listener, const OwnPlaces& places) {
    const bool is_unix = listener.is_unix();
    add(native(std::move(listener), {.waits = true}, places, [most, is_unix](int /*client*/) {
        return Access{most, nullptr, is_unix};
    }));
}

ListeningEndpoint Server::native(Listener listener, AcceptRules rules, const OwnPlaces& places,
                                 std::function<Access(int client)> access) {
    if (context_.api.empty()) context_.api = Connection::api_of(context_.host);
    return {std::move(listener),
            [this, access = std::move(access)](FileDescriptor socket, std::function<void()> wake) {
                Access granted = access(socket.get());
                return std::make_unique<Connection>(std::move(socket), context_, std::move(granted),
                                                    std::move(wake));
            },
            std::move(rules), places};
}

Server::~Server() {
    for (const Client& connection : connections_)
        connection.peer->end();
}

void Server::run(const std::function<bool()>& stopped) {
    std::vector<pollfd> polled;
    while (!stopped()) {
        const auto before = Clock::now();
        polled.assign(1, {wakeup_fd_.get(), POLLIN, 0});
        for (const Endpoint& endpoint : endpoints_) {
            const auto may_place = [&] {
                return count(connections_, endpoint) + count(closed_, endpoint) < places_of(endpoint) ||
                       longest_silent(endpoint, before) != connections_.end();
            };
            polled.push_back({endpoint.acceptor.polled(before, may_place), POLLIN, 0});
        }
        for (const Client& connection : connections_) {
            const short events = connection.peer->events();
            polled.push_back({events == 0 ? -1 : connection.peer->socket(), events, 0});
        }
        const int wait_ms = closed_.empty() ? poll_interval_ms : reap_interval_ms;
        if (::poll(polled.data(), polled.size(), wait_ms) < 0) {
            if (errno == EINTR) continue;
            throw HardwareError(fmt::format("poll: {}", std::strerror(errno)));
        }
        std::uint64_t wakeups = 0;
        if (polled[0].revents != 0 && ::read(wakeup_fd_.get(), &wakeups, sizeof wakeups) < 0) wakeups = 0;
        // New connections stand behind those that were polled.
        const std::size_t first = 1 + endpoints_.size();
        for (std::size_t i = first; i < polled.size(); ++i)
            connections_[i - first].peer->serve(polled[i].revents);
        const auto now = Clock::now();
        for (const Client& connection : connections_)
            if (!connection.peer->gone()) connection.peer->look_at(now);
        for (std::size_t i = 0; i < endpoints_.size(); ++i) {
            Endpoint& endpoint = endpoints_[i];
            if (polled[1 + i].revents != 0)
                endpoint.acceptor.accept(
                    now, [&] { return make_place(endpoint, now); },
                    [&](FileDescriptor client) { open(endpoint, std::move(client)); });
        }
        reap_closed_connections();
    }
}

std::size_t Server::count(const Clients& clients, const Endpoint& endpoint) const {
    return static_cast<std::size_t>(std::count_if(clients.begin(), clients.end(), [&](const Client& client) {
        return endpoint.places.clients > 0 ? client.endpoint == &endpoint
                                           : client.endpoint->places.clients == 0;
    }));
}

std::size_t Server::places_of(const Endpoint& endpoint) const {
    if (endpoint.places.clients > 0) return endpoint.places.clients;
    // Clients over a network, which prove nothing at first, never take the last ones.
    return limits_.clients + (endpoint.acceptor.listener().is_unix() ? limits_.local_clients : 0);
}

Server::Clients::iterator Server::longest_silent(const Endpoint& endpoint, Clock::time_point now) {
    auto longest = connections_.end();
    Clock::time_point earliest = now;
    for (auto client = connections_.begin(); client != connections_.end(); ++client) {
        if (client->endpoint != &endpoint || client->peer->gone()) continue;
        const auto from = client->peer->may_end_from(endpoint.places.idle);
        if (from > earliest) continue;
        earliest = from;
        longest = client;
    }
    return longest;
}

bool Server::make_place(const Endpoint& endpoint, Clock::time_point now) {
    const std::size_t connected = count(connections_, endpoint), places = places_of(endpoint);
    if (connected + count(closed_, endpoint) < places) return true;
    // A client that has been ended gives its place back once its call has ended.
    if (connected < places) return false;
    if (const auto silent = longest_silent(endpoint, now); silent != connections_.end()) silent->peer->end();
    return false;
}

void Server::open(const Endpoint& endpoint, FileDescriptor client) {
    try {
        auto peer = endpoint.open(std::move(client), [this] {
            const std::uint64_t one = 1;
            // It fails only where it has rung so often that it need not.
            [[maybe_unused]] const ssize_t bytes = ::write(wakeup_fd_.get(), &one, sizeof one);
        });
        connections_.push_back({std::move(peer), &endpoint});
    } catch (const std::exception&) { // no memory, or no thread: the others go on
    }
}

Access Server::access_of(bool is_unix, int client) {
    if (is_unix) return {permission_of_peer(client, admin_group_), nullptr, true};
    if (tokens_.empty()) return {Permission::scene, nullptr, false};
    return {{}, &tokens_, false, address_of_peer(client)};
}

void Server::reap_closed_connections() {
    const auto split =
        std::stable_partition(connections_.begin(), connections_.end(),
                              [](const Client& connection) { return !connection.peer->gone(); });
    std::move(split, connections_.end(), std::back_inserter(closed_));
    connections_.erase(split, connections_.end());
    std::erase_if(closed_, [](const Client& connection) { return connection.peer->at_rest(); });
}

} // namespace obscura::service
