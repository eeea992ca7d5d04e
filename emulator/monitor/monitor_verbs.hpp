// SPDX-License-Identifier: Apache-2.0
// Monitor verbs: the table of requests that the monitor socket answers.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::emulator {

/// A number that a request may carry.
struct VerbParameter {
    std::string_view name, help;
    std::uint64_t least = 0, most = 0, by_default = 0;
};

/// Values of a verb's parameters by name, all of them set and within their ranges.
using VerbArguments = std::map<std::string_view, std::uint64_t>;

/// One row of the table.
struct MonitorVerb {
    std::string_view name, help;
    std::vector<VerbParameter> parameters;
    std::function<std::string(const VerbArguments&)> answer; ///< gives a JSON object
};

/// Answers a request, an object with "verb" and the parameters of that verb, with an object; a request that
/// is not understood with {"error": WHY}. The verb "describe" lists the others. Never throws.
[[nodiscard]] std::string answer_request(const std::vector<MonitorVerb>& verbs,
                                         std::string_view request) noexcept;

} // namespace obscura::emulator
