// SPDX-License-Identifier: Apache-2.0
#include "instrument/link/admission.hpp"

#include "core/realtime/log.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>

namespace obscura::instrument {

bool Admission::admits(std::uint32_t ip, std::string_view who) const {
    if (allowed_.empty() || ip >> 24U == IN_LOOPBACKNET || any_contains(allowed_, ip)) return true;
    if (last_refused_.exchange(ip) != ip) {
        const in_addr address{htonl(ip)};
        std::array<char, INET_ADDRSTRLEN> text{};
        ::inet_ntop(AF_INET, &address, text.data(), text.size());
        log_warning("instrument: {} connection from {} refused: not in --allow", who, text.data());
    }
    return false;
}

bool Admission::admits_peer(int socket, std::string_view who) const {
    sockaddr_in peer{};
    socklen_t size = sizeof peer;
    return ::getpeername(socket, reinterpret_cast<sockaddr*>(&peer), &size) == 0 &&
           admits(ntohl(peer.sin_addr.s_addr), who);
}

} // namespace obscura::instrument
