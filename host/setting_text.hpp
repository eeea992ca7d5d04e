// SPDX-License-Identifier: Apache-2.0
// Values of a camera's settings as the command line writes and reads them.
#pragma once

#include "host/daemon_calls.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace obscura::host {

/// Strings without quotes, numbers in their shortest exact form, true and false.
[[nodiscard]] std::string plain_text(const CallJson& value);

/// The value that `text` is: true, false, a finite number, else a string.
[[nodiscard]] CallJson value_of_text(std::string_view text);

/// Map of the words NAME=VALUE. Throws UsageError naming the word that is none, or a name that comes twice.
[[nodiscard]] CallJson assignments(std::string_view verb, const std::vector<std::string>& words);

/// Throws CallError "bad-argument" with a suggestion unless `map` has a member `name`.
void require_member(std::string_view verb, const CallJson& map, const std::string& name);

} // namespace obscura::host
