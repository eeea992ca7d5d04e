// SPDX-License-Identifier: Apache-2.0
#include "service/acceptor.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <cerrno>
#include <utility>

namespace obscura::service {
namespace {

/// Clients that are accepted before those that are connected have their turn.
constexpr int max_accepted = 4;

/// Has the kernel find a client of a TCP socket that has gone without a word, within half a minute: its place
/// is wanted. No use, and no harm, for a Unix socket.
void keep_alive(int socket) {
    const auto set = [socket](int level, int option, int value) {
        ::setsockopt(socket, level, option, &value, sizeof value);
    };
    set(SOL_SOCKET, SO_KEEPALIVE, 1);
    set(IPPROTO_TCP, TCP_KEEPIDLE, 10); // s
    set(IPPROTO_TCP, TCP_KEEPINTVL, 5); // s
    set(IPPROTO_TCP, TCP_KEEPCNT, 4);
}

} // namespace

Acceptor::Acceptor(Listener listener, AcceptRules rules)
    : listener_(std::move(listener)), rules_(std::move(rules)) {}

int Acceptor::polled(Clock::time_point now, const HasPlace& may_place) const {
    if (now < accepts_from_ || (rules_.waits && may_place && !may_place())) return -1;
    return listener_.socket();
}

void Acceptor::accept(Clock::time_point now, const HasPlace& has_place,
                      const std::function<void(FileDescriptor)>& open) {
    for (int i = 0; i < max_accepted; ++i) {
        if (rules_.waits && !has_place()) return;
        FileDescriptor client = listener_.accept();
        if (!client) {
            if (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM)
                accepts_from_ = now + pause;
            return;
        }
        if (rules_.admits && !rules_.admits(client.get())) continue;
        if (rules_.waits || has_place()) {
            if (!listener_.is_unix()) keep_alive(client.get());
            open(std::move(client));
            continue;
        }
        // The buffer of a new connection has room for it.
        [[maybe_unused]] const ssize_t bytes =
            ::send(client.get(), rules_.refusal.data(), rules_.refusal.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    }
}

Acceptor::Clock::time_point may_end_from(const IdleRules& rules, Acceptor::Clock::time_point heard,
                                         bool mute) {
    const auto& limit = mute && rules.mute ? rules.mute : rules.idle;
    return limit ? heard + *limit : Acceptor::Clock::time_point::max();
}

} // namespace obscura::service
