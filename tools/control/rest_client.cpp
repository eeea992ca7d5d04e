// SPDX-License-Identifier: Apache-2.0
#include "tools/control/rest_client.hpp"

#include "tools/control/daemon_options.hpp"

#include <fmt/format.h>

#include <utility>

namespace obscura::tools {
namespace {

/// The word of docs/control.md for the answer of the server.
std::string code_of(const HttpAnswer& answer, const host::CallJson& problem) {
    const std::string type = problem.value("type", std::string());
    if (answer.status == 401 || answer.status == 403) return "forbidden";
    if (answer.status == 409) return type.ends_with(":not-now") ? "not-now" : "controlled";
    if (answer.status == 404) return "unknown-call";
    if (answer.status == 429) return "busy";
    return answer.status == 400 || answer.status == 422 ? "bad-argument" : "internal";
}

} // namespace

RestClient::RestClient(std::string_view verb, const HttpOptions& options)
    : verb_(verb), client_(verb, options.url, options.token, options.authority, options.timeout_s) {}

host::CallJson RestClient::get(const std::string& path) {
    return parsed(get_bytes(path));
}

host::CallJson RestClient::ask(std::string_view method, const std::string& path, const host::CallJson& body) {
    return parsed(checked(client_.ask(method, path, body.dump())));
}

HttpAnswer RestClient::get_bytes(const std::string& path) {
    return checked(client_.ask("GET", path));
}

host::CallJson RestClient::parsed(const HttpAnswer& answer) const {
    host::CallJson json = host::CallJson::parse(answer.body, nullptr, false);
    if (json.is_object()) return json;
    throw HardwareError(fmt::format("obscura {}: what answers there is no obscura-web", verb_));
}

HttpAnswer RestClient::checked(HttpAnswer answer) const {
    if (answer.status >= 200 && answer.status < 300) return answer;
    const host::CallJson problem = host::CallJson::parse(answer.body, nullptr, false);
    const bool told = problem.is_object() && problem.contains("detail") && problem["detail"].is_string();
    const std::string line = refusal_line(
        verb_, call_,
        told ? problem["detail"].get<std::string>() : fmt::format("HTTP status {}", answer.status),
        answer.status == 401 ? "--token-file FILE, OBSCURA_TOKEN, or the whole link that obscura-web prints"
                             : "");
    if (!told || answer.status == 503) throw HardwareError(line);
    throw host::CallError(code_of(answer, problem), line);
}

std::vector<host::CallJson> RestClient::states() {
    const host::CallJson answer = get("/api/v1/state");
    std::vector<host::CallJson> states;
    for (const host::CallJson& state : answer.at("daemons"))
        states.push_back(state);
    if (states.empty())
        throw HardwareError(fmt::format("obscura {}: no daemon runs behind that address", verb_));
    return states;
}

std::vector<host::CallJson> RestClient::events(std::uint64_t after) {
    const host::CallJson answer = get(fmt::format("/api/v1/events?follow=0&after={}", after));
    std::vector<host::CallJson> events;
    for (const host::CallJson& event : answer.at("events"))
        events.push_back(event);
    return events;
}

} // namespace obscura::tools
