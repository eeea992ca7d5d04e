// SPDX-License-Identifier: Apache-2.0
// What a host offers to the clients of its server: a session for each connection.
#pragma once

#include "service/call.hpp"

#include <nlohmann/json.hpp>

#include <memory>
#include <string>

namespace obscura::service {

/// State of one client, and the calls that work on it. Its calls run one after the other, those that overtake
/// beside them.
class Session {
public:
    virtual ~Session() = default;
    /// Rows of the host, valid while the session lives.
    [[nodiscard]] virtual Calls calls() = 0;
    /// Further members of the answer of `describe`.
    [[nodiscard]] virtual nlohmann::json description() const { return nlohmann::json::object(); }
    /// Further members of `limits` in the answer of `hello`.
    [[nodiscard]] virtual nlohmann::json limits() const { return nlohmann::json::object(); }
};

/// Maker of sessions. open() is called by the server's thread.
class Host {
public:
    virtual ~Host() = default;
    [[nodiscard]] virtual std::string version() const = 0;
    [[nodiscard]] virtual std::unique_ptr<Session> open() = 0;
};

} // namespace obscura::service
