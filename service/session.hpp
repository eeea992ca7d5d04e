// SPDX-License-Identifier: Apache-2.0
// What a host offers to the clients of its server: a session for each connection.
#pragma once

#include "service/call.hpp"

#include <nlohmann/json.hpp>

#include <memory>
#include <string>

namespace obscura::service {

/// State of one client, and the calls that work on it. Its calls run one after the other; those that run
/// beside others (Call::beside) do so on threads of their own.
class Session {
public:
    virtual ~Session() = default;
    /// Rows of the host, valid while the session lives.
    [[nodiscard]] virtual Calls calls() = 0;
    /// Further members of the answer of `describe`.
    [[nodiscard]] virtual nlohmann::json description() const { return nlohmann::json::object(); }
};

/// Maker of sessions. Thread-safe: sessions are opened, used and destroyed by the threads of their
/// connections, the first one, for its table of calls, by that which makes the server.
class Host {
public:
    virtual ~Host() = default;
    [[nodiscard]] virtual std::string version() const = 0;
    /// Further members of `limits` in the answer of `hello`.
    [[nodiscard]] virtual nlohmann::json limits() const { return nlohmann::json::object(); }
    [[nodiscard]] virtual std::unique_ptr<Session> open() = 0;
};

} // namespace obscura::service
