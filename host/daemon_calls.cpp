// SPDX-License-Identifier: Apache-2.0
#include "host/daemon_calls.hpp"

namespace obscura::host {

ExitStatus CallError::status_of(std::string_view code) {
    if (code == "controlled" || code == "busy") return exit_controlled;
    if (code == "forbidden" || code == "no-hello") return exit_not_allowed;
    if (code == "bad-argument" || code == "bad-scene" || code == "too-large") return exit_config;
    if (code == "unknown-call" || code == "bad-message") return exit_hardware;
    if (code == "bad-use") return exit_no_input;
    return exit_failure;
}

} // namespace obscura::host
