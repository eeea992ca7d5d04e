// SPDX-License-Identifier: Apache-2.0
// Calls of a daemon over the native protocol of its [control] sockets.
#pragma once

#include "host/daemon_calls.hpp"

#include <memory>
#include <string>
#include <string_view>

namespace obscura::tools {

struct NativeOptions {
    double timeout_s = 90;    ///< longest silence of the daemon
    std::string token_file{}; ///< that the daemon wants; empty: none
};

/// `address`: "HOST:PORT" or the path of a Unix socket. `verb` stands in front of messages. Throws
/// HardwareError, CallError.
[[nodiscard]] std::unique_ptr<host::DaemonCalls>
connect_natively(std::string_view verb, const std::string& address, const NativeOptions& options);

} // namespace obscura::tools
