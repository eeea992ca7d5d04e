// SPDX-License-Identifier: Apache-2.0
#include "service/server.hpp"

#include "core/error.hpp"
#include "service/connection.hpp"
#include "service/failure.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <utility>

namespace obscura::service {
namespace {

constexpr int look_period_ms = 200;
/// Clients that are accepted before those that are connected have their turn.
constexpr int most_accepted = 16;

} // namespace

Server::Server(const Limits& limits, Host& host, std::vector<Listener> listeners, Tokens tokens)
    : limits_(limits),
      host_(host),
      listeners_(std::move(listeners)),
      tokens_(std::move(tokens)),
      bell_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    if (!bell_) throw HardwareError(fmt::format("eventfd: {}", std::strerror(errno)));
}

Server::~Server() {
    for (const std::unique_ptr<Connection>& connection : connections_)
        connection->end();
}

void Server::run(const std::function<bool()>& stopped) {
    std::vector<pollfd> polled;
    while (!stopped()) {
        polled.assign(1, {bell_.get(), POLLIN, 0});
        for (const Listener& listener : listeners_)
            polled.push_back({listener.socket(), POLLIN, 0});
        for (const std::unique_ptr<Connection>& connection : connections_)
            polled.push_back({connection->socket(), connection->events(), 0});
        if (::poll(polled.data(), polled.size(), look_period_ms) < 0) {
            if (errno == EINTR) continue;
            throw HardwareError(fmt::format("poll: {}", std::strerror(errno)));
        }
        std::uint64_t rings = 0;
        if (polled[0].revents != 0 && ::read(bell_.get(), &rings, sizeof rings) < 0) rings = 0;
        // New connections stand behind those that were polled.
        const std::size_t first = 1 + listeners_.size();
        for (std::size_t i = first; i < polled.size(); ++i)
            connections_[i - first]->serve(polled[i].revents);
        const auto now = Connection::Clock::now();
        for (const std::unique_ptr<Connection>& connection : connections_)
            if (!connection->gone()) connection->look_at(now);
        for (std::size_t i = 0; i < listeners_.size(); ++i)
            if (polled[1 + i].revents != 0) accept(listeners_[i]);
        bury();
    }
}

void Server::accept(const Listener& listener) {
    for (int i = 0; i < most_accepted; ++i) {
        FileDescriptor client = listener.accept();
        if (!client) return;
        if (connections_.size() + gone_.size() < limits_.clients) {
            const Access access = access_of(listener, client.get());
            connections_.push_back(
                std::make_unique<Connection>(std::move(client), limits_, host_, access, memory_, [this] {
                    const std::uint64_t one = 1;
                    // It fails only where it has rung so often that it need not.
                    [[maybe_unused]] const ssize_t bytes = ::write(bell_.get(), &one, sizeof one);
                }));
            continue;
        }
        const Outgoing refusal =
            make_message(MessageKind::error, 0,
                         {{"code", name_of(FailureCode::busy)},
                          {"message", fmt::format("{} clients are connected already, allowed {}",
                                                  limits_.clients, limits_.clients)}});
        // The buffer of a new connection has room for it.
        [[maybe_unused]] const ssize_t bytes =
            ::send(client.get(), refusal.start.data(), refusal.start.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    }
}

Access Server::access_of(const Listener& listener, int client) {
    if (listener.is_unix()) return {permission_of_peer(client), nullptr, true};
    if (tokens_.empty()) return {Permission::scene, nullptr, false};
    return {{}, &tokens_, false};
}

void Server::bury() {
    const auto split = std::stable_partition(
        connections_.begin(), connections_.end(),
        [](const std::unique_ptr<Connection>& connection) { return !connection->gone(); });
    std::move(split, connections_.end(), std::back_inserter(gone_));
    connections_.erase(split, connections_.end());
    std::erase_if(gone_, [](const std::unique_ptr<Connection>& connection) { return connection->at_rest(); });
}

} // namespace obscura::service
