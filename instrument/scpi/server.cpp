// SPDX-License-Identifier: Apache-2.0
#include "instrument/scpi/server.hpp"

#include "instrument/link/recorded_link.hpp"
#include "instrument/scpi/line_reader.hpp"
#include "instrument/scpi/session.hpp"

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <exception>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

namespace obscura::instrument {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int scpi_poll_interval_ms = 200;

/// Whether the socket is ready for `what` within scpi_poll_interval_ms.
bool ready(int socket, short what) {
    pollfd one{socket, what, 0};
    return ::poll(&one, 1, scpi_poll_interval_ms) > 0;
}

/// Sends all of `bytes`. False: the client has gone, does not read, or `ended` is true.
bool send_all(int socket, std::string_view bytes, std::chrono::seconds timeout,
              const std::function<bool()>& ended) {
    const Clock::time_point end = Clock::now() + timeout;
    while (!bytes.empty()) {
        const ssize_t sent = ::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
        if (sent > 0) {
            bytes.remove_prefix(static_cast<std::size_t>(sent));
        } else if (sent < 0 && errno != EAGAIN && errno != EINTR) {
            return false;
        } else if (!ready(socket, POLLOUT) && (ended() || Clock::now() > end)) {
            return false;
        }
    }
    return true;
}

} // namespace

ScpiServer::ScpiServer(const ScpiLimits& limits, DaemonAddress daemon, std::string version,
                       std::vector<ScpiPort> ports, const Admission& admission)
    : limits_(limits), daemon_(std::move(daemon)), version_(std::move(version)) {
    for (ScpiPort& port : ports)
        ports_.push_back(
            {service::Acceptor(
                 std::move(port.listener),
                 {.admits = [&admission](int socket) { return admission.admits_peer(socket, "SCPI"); }}),
             port.may_change});
}

ScpiServer::~ScpiServer() {
    ending_ = true;
    reap_closed_clients(true);
}

void ScpiServer::reap_closed_clients(bool all) {
    std::erase_if(clients_, [all](const std::unique_ptr<Client>& client) {
        if (!all && !client->done) return false;
        client->thread.join();
        return true;
    });
}

void ScpiServer::serve(Client& client) const {
    const int socket = client.socket.get();
    const std::function<bool()> ended = [this] { return ending_.load(); };
    DaemonLink daemon(daemon_);
    RecordedLink link(daemon, "SCPI");
    link.set_peer(service::address_of_peer(socket));
    ScpiSession session(table_, link, version_, client.may_change, ended);
    LineReader lines(limits_.line_bytes);
    std::array<char, 4096> buffer;
    while (!ending_) {
        if (!ready(socket, POLLIN)) continue;
        const ssize_t got = ::recv(socket, buffer.data(), buffer.size(), 0);
        if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) return;
        if (got < 0) continue;
        client.heard = Clock::now();
        lines.give({buffer.data(), static_cast<std::size_t>(got)});
        while (const auto line = lines.next()) {
            if (!*line) {
                session.overrun();
                continue;
            }
            std::string response = session.execute(**line);
            if (ending_) return;
            if (!response.empty() && !send_all(socket, response += '\n', limits_.unread, ended)) return;
        }
        if (lines.thrown_away() > limits_.thrown_away_bytes) return;
    }
}

std::size_t ScpiServer::read_only_clients() const {
    return static_cast<std::size_t>(std::count_if(clients_.begin(), clients_.end(),
                                                  [](const auto& client) { return !client->may_change; }));
}

void ScpiServer::make_room(bool of_read_only) {
    auto longest = clients_.end();
    for (auto client = clients_.begin(); client != clients_.end(); ++client)
        if ((!of_read_only || !(*client)->may_change) &&
            (longest == clients_.end() || (*client)->heard.load() < (*longest)->heard.load()))
            longest = client;
    if (longest == clients_.end() ||
        Clock::now() < service::may_end_from(limits_.idle, (*longest)->heard.load(), false))
        return;
    ::shutdown((*longest)->socket.get(), SHUT_RDWR);
    (*longest)->thread.join();
    clients_.erase(longest);
}

bool ScpiServer::make_place(const Port& port) {
    reap_closed_clients(false);
    // Clients of ports for queries leave places for those that command.
    const auto has_place = [&] { return port.may_change || read_only_clients() < limits_.read_only; };
    if (!has_place()) make_room(true);
    if (!has_place()) return false;
    if (clients_.size() >= limits_.clients) make_room(false);
    return clients_.size() < limits_.clients;
}

void ScpiServer::open(const Port& port, FileDescriptor socket) {
    auto client = std::make_unique<Client>();
    client->socket = std::move(socket);
    client->may_change = port.may_change;
    Client& one = *clients_.emplace_back(std::move(client));
    try {
        one.thread = std::thread([this, &one] {
            try {
                serve(one);
            } catch (const std::exception&) { // memory is short: this client is given up
            }
            ::shutdown(one.socket.get(), SHUT_RDWR); // closed when it is joined
            one.done = true;
        });
    } catch (const std::system_error&) { // no thread is left: the others go on
        clients_.pop_back();
    }
}

void ScpiServer::run(const std::function<bool()>& stopped) {
    while (!stopped()) {
        std::vector<pollfd> watched;
        for (const Port& port : ports_)
            watched.push_back({port.acceptor.polled(Clock::now()), POLLIN, 0});
        if (::poll(watched.data(), watched.size(), scpi_poll_interval_ms) > 0)
            for (std::size_t i = 0; i < ports_.size(); ++i)
                if (watched[i].revents != 0)
                    ports_[i].acceptor.accept(
                        Clock::now(), [&] { return make_place(ports_[i]); },
                        [&](FileDescriptor socket) { open(ports_[i], std::move(socket)); });
        reap_closed_clients(false);
    }
}

} // namespace obscura::instrument
