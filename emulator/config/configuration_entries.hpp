// SPDX-License-Identifier: Apache-2.0
// The configuration of a daemon key by key, with the source of each value.
#pragma once

#include "config/entries.hpp"
#include "emulator/config/daemon_config.hpp"

#include <string>
#include <vector>

namespace obscura::emulator {

/// All keys of print_config(), in its order; those of [[camera]] as "camera[0].gige.port".
[[nodiscard]] std::vector<config::Entry> configuration_entries(const DaemonConfig& config);

/// SHA-256 of the lines "KEY = VALUE" of the entries, sorted by key, as 64 hexadecimal digits: equal for
/// configurations that do the same.
[[nodiscard]] std::string configuration_sha256(const std::vector<config::Entry>& entries);

} // namespace obscura::emulator
