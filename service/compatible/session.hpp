// SPDX-License-Identifier: Apache-2.0
// What a host offers to the published client: a session that runs its commands.
#pragma once

#include "service/call.hpp"
#include "service/compatible/arguments.hpp"
#include "service/compatible/commands.hpp"
#include "service/compatible/value.hpp"
#include "service/memory_account.hpp"

#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace obscura::service::compatible {

/// Answer of a command in the making.
class Reply {
public:
    /// Sets a field.
    void set(std::string_view name, Value value) { fields.push_back({std::string(name), std::move(value)}); }
    /// Sets the field of bytes that is sent last, and without a copy.
    void set_bytes(std::string_view name, std::string bytes) {
        bytes_name = name;
        body = std::move(bytes);
    }
    /// Lines of log that the client prints.
    void warn(std::string line) { lines.push_back("[warning] " + std::move(line)); }
    void inform(std::string line) { lines.push_back("[info] " + std::move(line)); }

    Fields fields{};
    std::string bytes_name{}, body{};
    std::vector<std::string> lines{};
    MemoryAccount::Share share{}; ///< of the answer, until it has been sent
};

/// State of one client. Its commands run one after the other, on a thread of the connection.
class Session {
public:
    virtual ~Session() = default;
    /// Runs one command. Throws Failure, whose text becomes the line of log `[error]`.
    virtual void run(const Command& command, const Arguments& arguments, Work& work, Reply& reply) = 0;
};

/// Maker of sessions. open() is called on the threads of connections, also of several at a time.
class Host {
public:
    virtual ~Host() = default;
    /// `memory` counts what the session keeps, and outlives it. Throws Error.
    [[nodiscard]] virtual std::unique_ptr<Session> open(MemoryAccount& memory) = 0;
};

} // namespace obscura::service::compatible
