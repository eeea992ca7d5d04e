// SPDX-License-Identifier: Apache-2.0
// Calls of a daemon through the REST interface of an obscura-web.
#pragma once

#include "host/daemon_calls.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace obscura::tools {

struct HttpOptions {
    std::string url;          ///< "https://HOST:8420"
    std::string token;        ///< bearer token
    std::string authority{};  ///< file of certificates that are trusted; empty: those of the system
    std::uint32_t camera = 0; ///< by which the daemon is asked for
    double timeout_s = 90;    ///< longest wait for an answer
};

/// Asks the server for its daemon, which must be the only one behind it. Certificates are verified. `verb`
/// stands in front of messages. Throws UsageError, HardwareError, CallError.
[[nodiscard]] std::unique_ptr<host::DaemonCalls> connect_by_http(std::string_view verb,
                                                                 const HttpOptions& options);

} // namespace obscura::tools
