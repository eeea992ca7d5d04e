// SPDX-License-Identifier: Apache-2.0
// Search for the calls of a daemon of this machine.
#pragma once

#include <string>

namespace obscura::instrument {

/// Where the daemon with the monitor socket `socket` takes calls; "": the only daemon of this machine that
/// this user may ask, or the packaged service's if none or several can be asked. Throws LinkError
/// ("connection-lost").
[[nodiscard]] std::string find_calls(const std::string& socket);

} // namespace obscura::instrument
