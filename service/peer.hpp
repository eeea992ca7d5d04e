// SPDX-License-Identifier: Apache-2.0
// Connection of a client as the server sees it, whatever it speaks.
#pragma once

#include "core/io/file_descriptor.hpp"
#include "service/acceptor.hpp"
#include "service/listener.hpp"

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>

namespace obscura::service {

/// All members are for the server's thread and do not block, but for the destructor.
class Peer {
public:
    using Clock = std::chrono::steady_clock;

    Peer() = default;
    Peer(const Peer&) = delete;
    Peer& operator=(const Peer&) = delete;
    /// Waits for the call in progress.
    virtual ~Peer() = default;

    [[nodiscard]] virtual int socket() const noexcept = 0;
    /// Events to poll for; 0: the socket is not polled.
    [[nodiscard]] virtual short events() const = 0;
    /// Receives and sends what `events`, as poll() gave them, allow.
    virtual void serve(short events) = 0;
    /// Called several times a second: ends the connection if what must come in time does not.
    virtual void look_at(Clock::time_point now) = 0;
    /// Ends the connection and cancels its calls.
    virtual void end() = 0;
    /// The client is gone.
    [[nodiscard]] virtual bool gone() const noexcept = 0;
    /// When its client may be ended for another one that waits, see IdleRules; max(): not at all, or a call
    /// of it is in progress.
    [[nodiscard]] virtual Clock::time_point may_end_from(const IdleRules& /*rules*/) const {
        return Clock::time_point::max();
    }
    /// Whether the destructor would not wait.
    [[nodiscard]] virtual bool at_rest() const noexcept = 0;
};

/// Places for the clients of one endpoint.
struct OwnPlaces {
    std::size_t clients = 0; ///< 0: none of its own, its clients count as all others of the server
    IdleRules idle{};
};

/// Listening endpoint: a socket and the protocol spoken there.
struct ListeningEndpoint {
    Listener listener;
    /// Makes the connection of a client; `wake` may be called on any thread, to have events() asked again.
    std::function<std::unique_ptr<Peer>(FileDescriptor socket, std::function<void()> wake)> open;
    AcceptRules rules{};
    OwnPlaces places{};
};

} // namespace obscura::service
