// SPDX-License-Identifier: Apache-2.0
#include "config/toml_text.hpp"

#include "config/keys.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace obscura::config {

std::string number_text(double value) {
    std::string text = fmt::format("{}", value);
    if (text.find_first_of(".en") == std::string::npos) text += ".0";
    return text;
}

namespace {

using Kind = Value::Kind;

std::string key_text(const std::string& key) {
    constexpr std::string_view bare = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-";
    const bool is_bare = !key.empty() && key.find_first_not_of(bare) == std::string::npos;
    return is_bare ? key : toml_string(key);
}

/// A value on one line; tables as inline tables.
std::string inline_text(const Value& value) {
    const auto join = [](const auto& parts, auto text_of) {
        std::string text;
        for (const auto& part : parts)
            text += (text.empty() ? "" : ", ") + text_of(part);
        return text;
    };
    switch (value.kind) {
    case Kind::boolean:
        return value.boolean ? "true" : "false";
    case Kind::integer:
        return fmt::format("{}", value.integer);
    case Kind::real:
        return number_text(value.real);
    case Kind::string:
    case Kind::date:
        return toml_string(value.string);
    case Kind::array:
        return "[" + join(value.items, inline_text) + "]";
    case Kind::table:
        break;
    }
    return "{" +
           join(value.members,
                [](const Member& m) {
                    return fmt::format("{} = {}", key_text(m.key), inline_text(m.value));
                }) +
           "}";
}

bool is_list(const Value& value) {
    return value.kind == Kind::array && !value.items.empty() &&
           std::all_of(value.items.begin(), value.items.end(),
                       [](const Value& item) { return item.kind == Kind::table; });
}

void write(const Value& table, const std::string& path, std::string& out) {
    for (const Member& member : table.members) {
        const Value& value = member.value;
        if (value.kind == Kind::table || value.kind == Kind::date || is_list(value)) continue;
        out += fmt::format("{} = {}\n", key_text(member.key), inline_text(value));
    }
    for (const Member& member : table.members) {
        const std::string inner = path.empty() ? key_text(member.key) : path + "." + key_text(member.key);
        if (member.value.kind == Kind::table) {
            out += fmt::format("\n[{}]\n", inner);
            write(member.value, inner, out);
        } else if (is_list(member.value)) {
            for (const Value& item : member.value.items) {
                out += fmt::format("\n[[{}]]\n", inner);
                write(item, inner, out);
            }
        }
    }
}

} // namespace

std::string toml_text(const Value& root) {
    std::string out;
    write(root, "", out);
    return out;
}

} // namespace obscura::config
