// SPDX-License-Identifier: Apache-2.0
#include "tools/batch/json_fields.hpp"

#include "config/document.hpp"
#include "core/error.hpp"
#include "core/text/printable.hpp"
#include "core/text/suggestion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace obscura::tools {
namespace {

/// Of "[json.exception.parse_error.101] parse error at line 1, column 2: syntax error while ...": what
/// follows the place, or the name of the exception.
std::string_view cause_of(std::string_view what) {
    for (const std::string_view end : {"] ", ": "})
        if (const std::size_t at = what.find(end); at != std::string_view::npos)
            if (end != ": " || what.starts_with("parse error")) what.remove_prefix(at + 2);
    return what;
}

} // namespace

nlohmann::json parse_json(std::string_view text, const std::string& name) {
    try {
        return nlohmann::json::parse(text);
    } catch (const nlohmann::json::out_of_range& error) { // a number such as 1e900
        throw InputError(fmt::format("{}: not valid JSON: {}", name, printable(cause_of(error.what()), 200)));
    } catch (const nlohmann::json::parse_error& error) {
        // `byte` counts from 1 and is that of the character read last.
        const std::string_view before = text.substr(0, error.byte > 0 ? error.byte - 1 : 0);
        const auto line = 1 + std::count(before.begin(), before.end(), '\n');
        const std::size_t column = before.size() - (before.rfind('\n') + 1) + 1; // npos + 1 is 0
        throw InputError(fmt::format("{}:{}:{}: not valid JSON: {}", name, line, column,
                                     printable(cause_of(error.what()), 200)));
    }
}

JsonFields::JsonFields(const nlohmann::json& object, std::string file, std::string place)
    : object_(object), file_(std::move(file)), place_(std::move(place)) {
    if (!object.is_object())
        throw InputError(fmt::format("{}: {}{}, allowed is an object", file_,
                                     place_.empty() ? "" : place_ + ": ", object.type_name()));
}

std::string JsonFields::place_of(std::string_view key) const {
    const std::string name = printable(key, 60);
    return place_.empty() ? name : place_ + "." + name;
}

void JsonFields::refuse(std::string_view key, std::string_view what) const {
    const auto found = object_.find(std::string(key));
    std::string value;
    if (found != object_.end() && found->is_primitive())
        value = printable(found->dump(-1, ' ', true, nlohmann::json::error_handler_t::replace), 80) + ": ";
    throw InputError(fmt::format("{}: {}: {}{}", file_, place_of(key), value, what));
}

const nlohmann::json& JsonFields::member(std::string_view key) {
    const auto found = object_.find(std::string(key));
    if (found == object_.end()) throw InputError(fmt::format("{}: {}: is missing", file_, place_of(key)));
    read_.emplace(key);
    return *found;
}

std::string JsonFields::text(std::string_view key) {
    const nlohmann::json& value = member(key);
    if (!value.is_string()) refuse(key, "allowed is a string");
    auto text = value.get<std::string>();
    if (text.find('\0') != std::string::npos) refuse(key, "has a NUL character");
    return text;
}

std::uint64_t JsonFields::whole(std::string_view key, std::uint64_t least, std::uint64_t most) {
    const nlohmann::json& value = member(key);
    const bool good = value.is_number_unsigned() && value.get<std::uint64_t>() >= least &&
                      value.get<std::uint64_t>() <= most;
    if (!good) refuse(key, fmt::format("allowed is a whole number, {} to {}", least, most));
    return value.get<std::uint64_t>();
}

double JsonFields::number(std::string_view key, double least, double most) {
    const nlohmann::json& value = member(key);
    const double number = value.is_number() ? value.get<double>() : std::nan("");
    if (!(number >= least && number <= most))
        refuse(key, fmt::format("allowed is a number, {} to {}", least, most));
    return number;
}

bool JsonFields::flag(std::string_view key) {
    const nlohmann::json& value = member(key);
    if (!value.is_boolean()) refuse(key, "allowed are true and false");
    return value.get<bool>();
}

JsonFields JsonFields::object(std::string_view key) {
    return {member(key), file_, place_of(key)};
}

std::size_t JsonFields::list(std::string_view key) {
    const nlohmann::json& value = member(key);
    if (!value.is_array()) refuse(key, "allowed is a list");
    return value.size();
}

JsonFields JsonFields::element(std::string_view key, std::size_t index) {
    return {member(key).at(index), file_, fmt::format("{}[{}]", place_of(key), index)};
}

void JsonFields::end() const {
    for (const auto& [key, value] : object_.items())
        if (read_.find(key) == read_.end())
            throw InputError(fmt::format("{}: {}: is not known, {}", file_, place_of(key),
                                         allowed_words(key, {read_.begin(), read_.end()})));
}

} // namespace obscura::tools
