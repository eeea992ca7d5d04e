// SPDX-License-Identifier: Apache-2.0
#include "web/server/problem.hpp"

#include "host/sha256.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>

namespace obscura::web {

using Json = nlohmann::ordered_json;

namespace {

/// "rules[1].percent" as a fragment of RFC 6901: "#/rules/1/percent".
std::string pointer_of(std::string_view field) {
    std::string pointer = "#/";
    for (const char c : field) {
        if (c == '.' || c == '[')
            pointer += '/';
        else if (c == '~' || c == '/')
            pointer += c == '~' ? "~0" : "~1";
        else if (c != ']')
            pointer += c;
    }
    return pointer;
}

} // namespace

std::string dumped(const Json& json) {
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Response json_answer(const Json& json) {
    Response response;
    response.type = "application/json";
    response.body = dumped(json);
    return response;
}

Response problem(unsigned status, std::string_view type, std::string_view detail, std::string_view field) {
    Json body{{"type", fmt::format("urn:obscura:{}", type)},
              {"status", status},
              {"title", type},
              {"detail", detail}};
    if (!field.empty()) body["errors"] = {{{"pointer", pointer_of(field)}, {"detail", detail}}};
    Response response;
    response.status = status;
    response.type = "application/problem+json";
    response.body = dumped(body);
    return response;
}

std::string tag_of(const Json& value) {
    return fmt::format("\"{}\"", host::sha256_of(dumped(value)).substr(0, 16));
}

bool names_tag(std::string_view header, std::string_view tag) {
    while (!header.empty()) {
        std::string_view one = header.substr(0, header.find(','));
        header.remove_prefix(std::min(one.size() + 1, header.size()));
        while (one.starts_with(' '))
            one.remove_prefix(1);
        while (one.ends_with(' '))
            one.remove_suffix(1);
        if (one.starts_with("W/")) one.remove_prefix(2);
        if (one == "*" || one == tag) return true;
    }
    return false;
}

} // namespace obscura::web
