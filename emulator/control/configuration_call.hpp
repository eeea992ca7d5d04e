// SPDX-License-Identifier: Apache-2.0
// Call `configuration`: every key in use, its value and where that comes from.
#pragma once

#include "emulator/config/daemon_config.hpp"
#include "service/call.hpp"

#include <functional>
#include <memory>

namespace obscura::emulator {

/// The answer for `config`.
[[nodiscard]] nlohmann::json describe_configuration(const DaemonConfig& config);

/// The row; `answer` gives describe_configuration() of the configuration in use.
[[nodiscard]] service::Call configuration_call(std::function<std::shared_ptr<const nlohmann::json>()> answer);

} // namespace obscura::emulator
