// SPDX-License-Identifier: Apache-2.0
// Calls `configuration` and `configuration.set`: every key in use, its value and where that comes from; other
// values.
#pragma once

#include "emulator/config/daemon_config.hpp"
#include "emulator/control/scene_requests.hpp"
#include "service/call.hpp"

#include <functional>
#include <memory>

namespace obscura::emulator {

/// Name of the call, and of what it has changed among the sources of values.
constexpr const char* set_configuration_name = "configuration.set";

/// The answer for `config`.
[[nodiscard]] nlohmann::json describe_configuration(const DaemonConfig& config);

/// The rows; `answer` gives describe_configuration() of the configuration in use; `requests` outlives them.
[[nodiscard]] service::Calls
configuration_calls(SceneRequests& requests, std::function<std::shared_ptr<const nlohmann::json>()> answer);

} // namespace obscura::emulator
