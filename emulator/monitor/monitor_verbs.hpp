// SPDX-License-Identifier: Apache-2.0
// Monitor verbs: the table of requests that the monitor socket answers.
#pragma once

#include "config/keys.hpp"
#include "service/call.hpp"
#include "service/permission.hpp"

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace obscura::emulator {

/// Answer to a request.
struct MonitorAnswer {
    MonitorAnswer(std::string json) : text(std::move(json)) {} // NOLINT(google-explicit-constructor)
    MonitorAnswer(std::string json, std::vector<int> files)
        : text(std::move(json)), descriptors(std::move(files)) {}

    std::string text;             ///< a JSON object
    std::vector<int> descriptors; ///< that are handed over with it; valid until the next request
};

/// A verb with the arguments of one request.
struct BoundVerb {
    config::Keys fields;
    std::function<MonitorAnswer()> answer;
};

/// One row of the table; its columns are those of a call (service/call.hpp).
struct MonitorVerb {
    std::string_view name, help;
    std::vector<service::Result> results; ///< members of the answer
    std::function<BoundVerb()> bind;      ///< with the defaults of its arguments
    /// What those who may open the socket have.
    service::Permission permission = service::Permission::view;
};

/// A row for a struct of arguments with a member `config::Keys keys()`, by which `answer` is called.
template<typename Arguments, typename Answer>
[[nodiscard]] MonitorVerb monitor_verb(std::string_view name, std::string_view help,
                                       std::vector<service::Result> results, Answer answer) {
    return {name, help, std::move(results), [answer = std::move(answer)] {
                const auto arguments = std::make_shared<Arguments>();
                return BoundVerb{arguments->keys(),
                                 [answer, arguments]() -> MonitorAnswer { return answer(*arguments); }};
            }};
}
/// Arguments of a verb without parameters.
struct NoParameters {
    [[nodiscard]] static config::Keys keys() { return {}; }
};

/// Answers a request, an object with "verb" and the parameters of that verb, with an object; a request that
/// is not understood with {"error": WHY}. The verb "describe" lists the others. Never throws.
[[nodiscard]] MonitorAnswer answer_request(const std::vector<MonitorVerb>& verbs,
                                           std::string_view request) noexcept;

} // namespace obscura::emulator
