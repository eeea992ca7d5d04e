// SPDX-License-Identifier: Apache-2.0
#include "instrument/lxi/server.hpp"

#include "instrument/lxi/identification.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <utility>

namespace obscura::instrument {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int lxi_poll_interval_ms = 200;

std::string host_name() {
    std::array<char, 256> name{};
    return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

} // namespace

LxiServer::LxiServer(service::Listener listener, std::string version, std::uint16_t scpi_port,
                     const Admission& admission)
    : acceptor_(std::move(listener),
                {.admits = [&admission](int socket) { return admission.admits_peer(socket, "LXI"); }}),
      version_(std::move(version)),
      scpi_port_(scpi_port) {}

bool LxiServer::serve(Client& client) const {
    std::array<char, 1024> buffer;
    const ssize_t got = ::recv(client.socket.get(), buffer.data(), buffer.size(), 0);
    if (got < 0) return errno == EAGAIN || errno == EINTR;
    client.head.append(buffer.data(), static_cast<std::size_t>(got));
    const bool whole = client.head.find("\r\n\r\n") != std::string::npos;
    if (got == 0 || (!whole && client.head.size() > max_head_bytes)) return false;
    if (!whole) return true;
    sockaddr_in own{};
    socklen_t size = sizeof own;
    ::getsockname(client.socket.get(), reinterpret_cast<sockaddr*>(&own), &size);
    std::array<char, INET_ADDRSTRLEN> address{};
    ::inet_ntop(AF_INET, &own.sin_addr, address.data(), address.size());
    const std::string answer =
        lxi_answer(client.head, {version_, host_name(), address.data(), ntohs(own.sin_port), scpi_port_});
    // Smaller than any socket's buffer: a client that does not read holds nothing up.
    (void)::send(client.socket.get(), answer.data(), answer.size(), MSG_NOSIGNAL);
    return false;
}

void LxiServer::run(const std::function<bool()>& stopped) {
    while (!stopped()) {
        std::vector<pollfd> watched{{acceptor_.polled(Clock::now()), POLLIN, 0}};
        for (const Client& client : clients_)
            watched.push_back({client.socket.get(), POLLIN, 0});
        ::poll(watched.data(), watched.size(), lxi_poll_interval_ms);
        const Clock::time_point now = Clock::now();
        std::size_t place = 0;
        std::erase_if(clients_, [&](Client& client) {
            const bool news = watched[++place].revents != 0;
            return news ? !serve(client) : now > client.until;
        });
        if (watched[0].revents != 0)
            acceptor_.accept(
                now, [&] { return clients_.size() < max_clients; },
                [&](FileDescriptor socket) {
                    clients_.push_back({std::move(socket), {}, now + timeout});
                });
    }
}

} // namespace obscura::instrument
