// SPDX-License-Identifier: Apache-2.0
#include "emulator/monitor/monitor_verbs.hpp"

#include "emulator/monitor/monitor_socket.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <exception>
#include <stdexcept>

namespace obscura::emulator {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view describe = "describe";

std::string refusal(std::string_view why) {
    // Replaces what is no UTF-8 in a text that quotes a request.
    return Json{{"error", why}}.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string described(const std::vector<MonitorVerb>& verbs) {
    Json list = Json::array();
    for (const MonitorVerb& verb : verbs) {
        Json parameters = Json::array();
        for (const VerbParameter& p : verb.parameters)
            parameters.push_back({{"name", p.name},
                                  {"type", "integer"},
                                  {"min", p.least},
                                  {"max", p.most},
                                  {"default", p.by_default},
                                  {"help", p.help}});
        list.push_back({{"name", verb.name}, {"help", verb.help}, {"parameters", std::move(parameters)}});
    }
    return Json{{"verbs", std::move(list)}}.dump();
}

std::string names_of(const std::vector<MonitorVerb>& verbs) {
    std::string names{describe};
    for (const MonitorVerb& verb : verbs)
        names += fmt::format(", {}", verb.name);
    return names;
}

/// Throws std::invalid_argument.
VerbArguments arguments_of(const MonitorVerb& verb, const Json& request) {
    VerbArguments arguments;
    for (const VerbParameter& p : verb.parameters)
        arguments[p.name] = p.by_default;
    for (const auto& [key, value] : request.items()) {
        if (key == "verb") continue;
        const auto p = std::find_if(verb.parameters.begin(), verb.parameters.end(),
                                    [&name = key](const VerbParameter& one) { return one.name == name; });
        if (p == verb.parameters.end()) {
            std::string names;
            for (const VerbParameter& one : verb.parameters)
                names += fmt::format("{}{}", names.empty() ? "" : ", ", one.name);
            throw std::invalid_argument(fmt::format("{}: {}: no such parameter, allowed are {}", verb.name,
                                                    key, names.empty() ? "none" : names));
        }
        if (!value.is_number_unsigned() || value.get<std::uint64_t>() < p->least ||
            value.get<std::uint64_t>() > p->most)
            throw std::invalid_argument(
                fmt::format("{}: {}: a whole number from {} to {}", verb.name, p->name, p->least, p->most));
        arguments[p->name] = value.get<std::uint64_t>();
    }
    return arguments;
}

MonitorAnswer answer_or_throw(const std::vector<MonitorVerb>& verbs, std::string_view text) {
    if (text.size() > monitor_request_bytes)
        return refusal(fmt::format("a request has at most {} bytes", monitor_request_bytes));
    const Json request = Json::parse(text, nullptr, false);
    if (!request.is_object() || !request.contains("verb") || !request["verb"].is_string())
        return refusal(R"(a request is a JSON object like {"verb": "state"})");
    const auto name = request["verb"].get<std::string>();
    if (name == describe) return described(verbs);
    const auto verb = std::find_if(verbs.begin(), verbs.end(),
                                   [&name](const MonitorVerb& one) { return one.name == name; });
    if (verb == verbs.end()) return refusal(fmt::format("no such verb, allowed are {}", names_of(verbs)));
    MonitorAnswer answer = verb->answer(arguments_of(*verb, request));
    if (answer.text.size() > monitor_answer_bytes)
        return refusal(fmt::format("{}: the answer has more than {} bytes", name, monitor_answer_bytes));
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
