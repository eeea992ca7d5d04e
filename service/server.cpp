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
/// Clients that are accepted before those that are connected have their turn.
constexpr int max_accepted = 4;
/// Where no client can be accepted, its connection waits on: poll() would tell of it again and again.
constexpr std::chrono::milliseconds accept_pause{200};

} // namespace

Server::Server(const Limits& limits, Host& host, std::vector<Listener> listeners, Tokens tokens,
               std::optional<gid_t> admin_group)
    : limits_(limits),
      tokens_(std::move(tokens)),
      admin_group_(admin_group),
      context_{limits_, host, memory_, listeners.empty() ? std::string() : Connection::api_of(host)},
      wakeup_fd_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    if (!wakeup_fd_) throw HardwareError(fmt::format("eventfd: {}", std::strerror(errno)));
    const Outgoing refusal =
        make_message(MessageKind::error, 0,
                     {{"code", name_of(FailureCode::busy)},
                      {"message", fmt::format("{} clients are connected already, allowed {}", limits.clients,
                                              limits.clients)}});
    for (Listener& listener : listeners) {
        const bool is_unix = listener.is_unix(); // no more once it has moved
        add({std::move(listener),
             [this, is_unix](FileDescriptor socket, std::function<void()> wake) {
                 Access access = access_of(is_unix, socket.get());
                 return std::make_unique<Connection>(std::move(socket), context_, std::move(access),
                                                     std::move(wake));
             },
             refusal.start});
    }
}

Server::~Server() {
    for (const std::unique_ptr<Peer>& connection : connections_)
        connection->end();
}

void Server::run(const std::function<bool()>& stopped) {
    std::vector<pollfd> polled;
    while (!stopped()) {
        polled.assign(1, {wakeup_fd_.get(), POLLIN, 0});
        const bool accepts = Peer::Clock::now() >= accept_from_;
        for (const ListeningEndpoint& endpoint : endpoints_)
            polled.push_back({accepts ? endpoint.listener.socket() : -1, POLLIN, 0});
        for (const std::unique_ptr<Peer>& connection : connections_) {
            const short events = connection->events();
            polled.push_back({events == 0 ? -1 : connection->socket(), events, 0});
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
            connections_[i - first]->serve(polled[i].revents);
        const auto now = Peer::Clock::now();
        for (const std::unique_ptr<Peer>& connection : connections_)
            if (!connection->gone()) connection->look_at(now);
        for (std::size_t i = 0; i < endpoints_.size(); ++i)
            if (polled[1 + i].revents != 0 && !accept(endpoints_[i])) accept_from_ = now + accept_pause;
        reap_closed_connections();
    }
}

bool Server::accept(const ListeningEndpoint& endpoint) {
    for (int i = 0; i < max_accepted; ++i) {
        FileDescriptor client = endpoint.listener.accept();
        if (!client) return errno != EMFILE && errno != ENFILE && errno != ENOBUFS && errno != ENOMEM;
        if (connections_.size() + closed_.size() < limits_.clients) {
            open(endpoint, std::move(client));
            continue;
        }
        // The buffer of a new connection has room for it.
        [[maybe_unused]] const ssize_t bytes = ::send(client.get(), endpoint.refusal.data(),
                                                      endpoint.refusal.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    }
    return true;
}

void Server::open(const ListeningEndpoint& endpoint, FileDescriptor client) {
    try {
        connections_.push_back(endpoint.open(std::move(client), [this] {
            const std::uint64_t one = 1;
            // It fails only where it has rung so often that it need not.
            [[maybe_unused]] const ssize_t bytes = ::write(wakeup_fd_.get(), &one, sizeof one);
        }));
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
                              [](const std::unique_ptr<Peer>& connection) { return !connection->gone(); });
    std::move(split, connections_.end(), std::back_inserter(closed_));
    connections_.erase(split, connections_.end());
    std::erase_if(closed_, [](const std::unique_ptr<Peer>& connection) { return connection->at_rest(); });
}

} // namespace obscura::service
