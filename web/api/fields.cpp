// SPDX-License-Identifier: Apache-2.0
#include "web/api/fields.hpp"

#include "core/text/printable.hpp"
#include "core/text/suggestion.hpp"
#include "web/server/problem.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <set>
#include <string>

namespace obscura::web {
namespace {

using Json = nlohmann::ordered_json;
using Type = Parameter::Type;

constexpr int max_levels = 12;           ///< of arrays and objects within each other
constexpr std::size_t max_members = 256; ///< of a body of any names

std::string shortened(std::string_view text) {
    return std::string(text.substr(0, 60));
}

[[noreturn]] void refuse(const std::string& detail, std::string_view field) {
    throw Refusal(422, "value", detail, field);
}

std::string allowed(const Parameter& field) {
    const std::string unit = field.unit.empty() ? "" : fmt::format(" {}", field.unit);
    switch (field.type) {
    case Type::boolean:
        return "true or false";
    case Type::integer:
    case Type::number:
        return field.max == std::numeric_limits<double>::max()
                   ? fmt::format("{} from {}{}", name_of(field.type), field.min, unit)
                   : fmt::format("{} from {} to {}{}", name_of(field.type), field.min, field.max, unit);
    case Type::string:
        if (!field.choices.empty()) return fmt::format("{}", fmt::join(field.choices, ", "));
        break;
    case Type::array:
        if (field.items == Type::any) break;
        return field.size == 0 ? fmt::format("array of {}s{}", name_of(field.items), unit)
                               : fmt::format("array of {} {}s{}", field.size, name_of(field.items), unit);
    case Type::object:
    case Type::any:
        break;
    }
    return std::string(name_of(field.type));
}

/// "; did you mean ...?" of a word that is none of the field's choices, if one is close.
std::string nearest(const Parameter& field, const Json& value) {
    if (!value.is_string() || field.choices.empty()) return {};
    return did_you_mean(value.get_ref<const std::string&>(), {field.choices.begin(), field.choices.end()});
}

const Parameter& field_row(std::string_view name, std::span<const Parameter> fields) {
    const auto found = std::find_if(fields.begin(), fields.end(),
                                    [name](const Parameter& field) { return field.name == name; });
    if (found != fields.end()) return *found;
    std::vector<std::string_view> names;
    for (const Parameter& field : fields)
        names.push_back(field.name);
    refuse(fmt::format("{}: no such field, {}", shortened(name), allowed_words(name, names)),
           shortened(name));
}

bool is_item(const Json& value, Type type) {
    return type == Type::number   ? value.is_number()
           : type == Type::string ? value.is_string()
           : type == Type::object ? value.is_object()
                                  : true;
}

bool has_type(const Json& value, const Parameter& field) {
    switch (field.type) {
    case Type::boolean:
        return value.is_boolean();
    case Type::integer:
        return value.is_number_integer() && value.get<double>() >= field.min &&
               value.get<double>() <= field.max;
    case Type::number:
        return value.is_number() && value.get<double>() >= field.min && value.get<double>() <= field.max;
    case Type::string:
        return value.is_string() && (field.choices.empty() ||
                                     std::find(field.choices.begin(), field.choices.end(),
                                               value.get_ref<const std::string&>()) != field.choices.end());
    case Type::array:
        return value.is_array() && (field.size == 0 || value.size() == field.size) &&
               std::all_of(value.begin(), value.end(),
                           [&field](const Json& item) { return is_item(item, field.items); });
    case Type::object:
        return value.is_object();
    case Type::any:
        return true;
    }
    return false;
}

/// Refuses values of which a required one is missing.
void require(const Json& values, std::span<const Parameter> fields) {
    for (const Parameter& field : fields)
        if (field.required && !values.contains(std::string(field.name)))
            refuse(fmt::format("{} is missing; allowed: {}", field.name, allowed(field)), field.name);
}

/// The number or boolean that a text of a query is; null if it is none.
Json value_of(std::string_view text) {
    if (text == "true" || text == "false") return text == "true";
    const char* const end = text.data() + text.size();
    std::uint64_t whole = 0;
    if (const auto read = std::from_chars(text.data(), end, whole); read.ec == std::errc{} && read.ptr == end)
        return whole;
    double number = 0;
    if (const auto read = std::from_chars(text.data(), end, number);
        read.ec == std::errc{} && read.ptr == end && std::isfinite(number))
        return number;
    return nullptr;
}

/// A text of a query that is a word as ids are, which needs no escapes; null if it is none.
Json word_of(std::string_view text) {
    const bool plain = std::all_of(text.begin(), text.end(), [](char c) {
        return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_' || c == '.';
    });
    return plain && !text.empty() ? Json(text) : Json();
}

} // namespace

Json read_query(std::string_view query, std::span<const Parameter> fields) {
    Json values = Json::object();
    while (!query.empty()) {
        const std::string_view one = query.substr(0, query.find('&'));
        query.remove_prefix(std::min(one.size() + 1, query.size()));
        if (one.empty()) continue;
        const std::string_view name = one.substr(0, one.find('='));
        const Parameter& field = field_row(name, fields);
        const std::string_view text =
            one.size() > name.size() ? one.substr(name.size() + 1) : std::string_view();
        Json value = field.type == Type::string ? word_of(text) : value_of(text);
        if (!has_type(value, field))
            refuse(fmt::format("{}: allowed: {}{}", field.name, allowed(field), nearest(field, value)),
                   field.name);
        values[std::string(field.name)] = std::move(value);
    }
    require(values, fields);
    return values;
}

namespace {

/// Refuses deep nesting, and a name that stands twice in an object: readers differ in which of the two they
/// take.
Json parse_strictly(std::string_view text) {
    std::array<std::set<std::string>, max_levels + 2> names;
    return Json::parse(text.begin(), text.end(), [&](int depth, Json::parse_event_t event, Json& parsed) {
        if (depth > max_levels)
            throw Refusal(400, "syntax",
                          fmt::format("more than {} arrays and objects within each other", max_levels));
        const auto level = static_cast<std::size_t>(depth);
        if (event == Json::parse_event_t::object_start) names[level + 1].clear();
        if (event == Json::parse_event_t::key && !names[level].insert(parsed.get<std::string>()).second)
            throw Refusal(
                400, "syntax",
                fmt::format("\"{}\" stands twice in an object", printable(parsed.get<std::string>(), 60)));
        return true;
    });
}

} // namespace

Json read_body(std::string_view text, const Route& route) {
    const bool empty = std::all_of(text.begin(), text.end(),
                                   [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; });
    Json body = Json::object();
    if (!empty) {
        try {
            body = parse_strictly(text);
        } catch (const Json::parse_error& error) {
            throw Refusal(400, "syntax", fmt::format("the body is no JSON, at byte {}", error.byte));
        } catch (const Json::exception&) {
            throw Refusal(400, "syntax", "the body has a number that is too large");
        }
    }
    if (!body.is_object()) throw Refusal(422, "value", "the body is no object");
    if (body.size() > max_members)
        throw Refusal(422, "value", fmt::format("more than {} members", max_members));
    if (route.body == Body::map) return body;
    for (const auto& [name, value] : body.items()) {
        const Parameter& field = field_row(name, route.fields);
        if (!has_type(value, field))
            refuse(fmt::format("{}: allowed: {}{}", field.name, allowed(field), nearest(field, value)),
                   field.name);
    }
    require(body, route.fields);
    return body;
}

} // namespace obscura::web
