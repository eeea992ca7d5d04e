// SPDX-License-Identifier: Apache-2.0
// Calls of a running daemon, whatever carries them.
#pragma once

#include "core/error.hpp"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::host {

using CallJson = nlohmann::ordered_json;

/// Exit statuses of verbs that call a daemon, beside those of core/error.hpp and after the same list.
constexpr auto exit_controlled = static_cast<ExitStatus>(75);  ///< another client has the camera
constexpr auto exit_not_allowed = static_cast<ExitStatus>(77); ///< the caller may not do that

/// A call that was not done; `code` as docs/control.md lists them.
class CallError : public Error {
public:
    CallError(std::string the_code, const std::string& line)
        : Error(status_of(the_code), line), code(std::move(the_code)) {}
    /// 78 for values that are refused, 75 and 77 as above, 69 if the daemon is gone or does not know the
    /// call, 1 if the camera's state does not allow it.
    [[nodiscard]] static ExitStatus status_of(std::string_view code);

    std::string code;
    std::string hint{}; ///< what to try; empty: nothing
};

/// The first signal arrived while a call waited. Its exit status is 1.
class Interrupted : public Error {
public:
    Interrupted() : Error(exit_failure, "interrupted") {}
};

/// Answer of a call.
struct CallAnswer {
    CallJson head;
    std::int32_t width = 0, height = 0;
    std::vector<std::uint16_t> pixels{}; ///< the array `pixels`, row-major; empty: the answer has none
};

/// Connection to a daemon. Thread-bound.
class DaemonCalls {
public:
    virtual ~DaemonCalls() = default;
    /// Makes a call of docs/reference/camera-calls.md and waits for its answer. Throws CallError,
    /// Interrupted.
    [[nodiscard]] virtual CallAnswer call(std::string_view name, const CallJson& fields) = 0;
    /// The map of an answer.
    [[nodiscard]] CallJson ask(std::string_view name, const CallJson& fields) {
        return call(name, fields).head;
    }
};

} // namespace obscura::host
