// SPDX-License-Identifier: Apache-2.0
// Text of a daemon's state for people.
#pragma once

#include <nlohmann/json.hpp>

#include <string>

namespace obscura::tools {

/// The answer to the call `state` as some lines for each camera. Numbers that are missing, as from
/// another version of the daemon, are shown as "-".
[[nodiscard]] std::string status_text(const nlohmann::ordered_json& state);

/// Whether every camera is idle or does what it should.
[[nodiscard]] bool none_bad(const nlohmann::ordered_json& state);

} // namespace obscura::tools
