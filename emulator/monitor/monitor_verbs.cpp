// SPDX-License-Identifier: Apache-2.0
#include "emulator/monitor/monitor_verbs.hpp"

#include "host/monitor_connection.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <exception>
#include <utility>

namespace obscura::emulator {
namespace {

using nlohmann::json;

constexpr std::string_view describe = "describe";

std::string refusal(std::string_view why) {
    // Replaces what is no UTF-8 in a text that quotes a request.
    return json{{"error", why}}.dump(-1, ' ', false, json::error_handler_t::replace);
}

std::string described(const std::vector<MonitorVerb>& verbs) {
    json rows = json::array();
    for (const MonitorVerb& verb : verbs)
        rows.push_back({{"name", verb.name},
                        {"help", verb.help},
                        {"permission", name_of(verb.permission)},
                        {"fields", service::describe(verb.bind().fields)},
                        {"results", service::describe(verb.results)}});
    return json{{"verbs", std::move(rows)}}.dump();
}

std::string names_of(const std::vector<MonitorVerb>& verbs) {
    std::string names{describe};
    for (const MonitorVerb& verb : verbs)
        names += fmt::format(", {}", verb.name);
    return names;
}

MonitorAnswer answer_or_throw(const std::vector<MonitorVerb>& verbs, std::string_view text) {
    if (text.size() > host::monitor_request_bytes)
        return refusal(fmt::format("a request has at most {} bytes", host::monitor_request_bytes));
    json request = json::parse(text, nullptr, false);
    if (!request.is_object() || !request.contains("verb") || !request["verb"].is_string())
        return refusal(R"(a request is a JSON object like {"verb": "state"})");
    const auto name = request["verb"].get<std::string>();
    if (name == describe) return described(verbs);
    const auto verb = std::find_if(verbs.begin(), verbs.end(),
                                   [&name](const MonitorVerb& one) { return one.name == name; });
    if (verb == verbs.end()) return refusal(fmt::format("no such verb, allowed are {}", names_of(verbs)));
    const BoundVerb bound = verb->bind();
    request.erase("verb");
    service::read_values(verb->name, request, bound.fields);
    MonitorAnswer answer = bound.answer();
    if (answer.text.size() > host::monitor_answer_bytes)
        return refusal(
            fmt::format("{}: the answer has more than {} bytes", name, host::monitor_answer_bytes));
    return answer;
}

} // namespace

MonitorAnswer answer_request(const std::vector<MonitorVerb>& verbs, std::string_view request) noexcept {
    try {
        return answer_or_throw(verbs, request);
    } catch (const std::exception& error) {
        return refusal(error.what());
    }
}

} // namespace obscura::emulator
