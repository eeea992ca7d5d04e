// SPDX-License-Identifier: Apache-2.0
// Answers in JSON, and refusals as problem documents (RFC 9457).
#pragma once

#include "web/server/message.hpp"

#include <nlohmann/json_fwd.hpp>

#include <exception>
#include <string>
#include <string_view>

namespace obscura::web {

/// One line of JSON; bytes that are no UTF-8 are replaced, numbers that are not finite become null.
[[nodiscard]] std::string dumped(const nlohmann::ordered_json& json);
/// 200 with a body of JSON.
[[nodiscard]] Response json_answer(const nlohmann::ordered_json& json);

/// `type`: the cause for programs, "urn:obscura:TYPE". `field`: what of the request is wrong, a name of the
/// body or the query, as "rules[1].percent"; the answer has it as a JSON Pointer. Empty: not known.
[[nodiscard]] Response problem(unsigned status, std::string_view type, std::string_view detail,
                               std::string_view field = {});

/// Thrown to refuse a request within a handler.
class Refusal : public std::exception {
public:
    Refusal(unsigned status, std::string_view the_type, std::string_view detail, std::string_view field = {})
        : response(problem(status, the_type, detail, field)), type(the_type) {}
    [[nodiscard]] const char* what() const noexcept override { return response.body.c_str(); }

    Response response;
    std::string type;
};

/// Entity tag of a value, in quotes.
[[nodiscard]] std::string tag_of(const nlohmann::ordered_json& value);
/// Whether a header If-Match or If-None-Match names the tag; "*" names all.
[[nodiscard]] bool names_tag(std::string_view header, std::string_view tag);

} // namespace obscura::web
