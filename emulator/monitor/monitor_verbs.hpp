// SPDX-License-Identifier: Apache-2.0
// Monitor verbs: the table of requests that the monitor socket answers.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace obscura::emulator {

/// A number that a request may carry.
struct VerbParameter {
    std::string_view name, help;
    std::uint64_t least = 0, most = 0, by_default = 0;
};

/// Values of a verb's parameters by name, all of them set and within their ranges.
using VerbArguments = std::map<std::string_view, std::uint64_t>;

/// Answer to a request.
struct MonitorAnswer {
    MonitorAnswer(std::string json) : text(std::move(json)) {} // NOLINT(google-explicit-constructor)
    MonitorAnswer(std::string json, std::vector<int> files)
        : text(std::move(json)), descriptors(std::move(files)) {}

    std::string text;             ///< a JSON object
    std::vector<int> descriptors; ///< that are handed over with it; valid until the next request
};

/// One row of the table.
struct MonitorVerb {
    std::string_view name, help;
    std::vector<VerbParameter> parameters;
    std::function<MonitorAnswer(const VerbArguments&)> answer;
};

/// Answers a request, an object with "verb" and the parameters of that verb, with an object; a request that
/// is not understood with {"error": WHY}. The verb "describe" lists the others. Never throws.
[[nodiscard]] MonitorAnswer answer_request(const std::vector<MonitorVerb>& verbs,
                                           std::string_view request) noexcept;

} // namespace obscura::emulator
