// SPDX-License-Identifier: Apache-2.0
// Acceptor of one listening socket: who may come, what becomes of those beyond the limit, pause where
// descriptors are short.
#pragma once

#include "core/io/file_descriptor.hpp"
#include "service/listener.hpp"

#include <chrono>
#include <functional>
#include <optional>
#include <string>

namespace obscura::service {

/// What a listening socket does with the clients that come.
struct AcceptRules {
    /// Sent to a client for which there is no place, which is disconnected.
    std::string refusal{};
    /// Such a client waits for a place instead: it is connected, and not heard.
    bool waits = false;
    /// Whether the machine at the other end may come; empty: any may.
    std::function<bool(int socket)> admits{};
};

/// Silence of a client after which it makes room for another one; none: it never does.
struct IdleRules {
    std::optional<std::chrono::milliseconds> idle{}; ///< since its last request
    std::optional<std::chrono::milliseconds> mute{}; ///< since it came, without a request
};

/// Takes clients off a listening socket. Thread-bound.
class Acceptor {
public:
    using Clock = std::chrono::steady_clock;
    /// Whether there is a place for a client; may make one by ending another client.
    using HasPlace = std::function<bool()>;

    explicit Acceptor(Listener listener, AcceptRules rules = {});

    /// The socket, to be polled for POLLIN; -1: no client is taken now. `may_place`: whether a client could
    /// get a place, which is asked where those without one wait.
    [[nodiscard]] int polled(Clock::time_point now, const HasPlace& may_place = {}) const;
    /// Takes clients that wait, a few at a time so that those that are connected have their turn, and hands
    /// them to `open` in non-blocking state. Where there is no descriptor or memory for one, polled() rests
    /// for `pause`: poll() would tell of that client again and again.
    void accept(Clock::time_point now, const HasPlace& has_place,
                const std::function<void(FileDescriptor)>& open);

    [[nodiscard]] const Listener& listener() const noexcept { return listener_; }

    static constexpr std::chrono::milliseconds pause{200};

private:
    Listener listener_;
    const AcceptRules rules_;
    Clock::time_point accepts_from_{};
};

/// When a client that was heard of last at `heard` may be ended for another one; never:
/// Acceptor::Clock::time_point::max(). `mute`: it has made no request yet.
[[nodiscard]] Acceptor::Clock::time_point may_end_from(const IdleRules& rules,
                                                       Acceptor::Clock::time_point heard, bool mute);

} // namespace obscura::service
