// SPDX-License-Identifier: Apache-2.0
// Only this translation unit includes toml++.
#include "config/document.hpp"

#include "core/error.hpp"
#include "core/io/text_file.hpp"
#include "core/text/printable.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cerrno>

namespace obscura::config {
namespace {

Position position(const toml::source_region& region) {
    return {region.begin.line, region.begin.column};
}

Value convert(const toml::node& node) {
    Value value;
    value.at = position(node.source());
    if (const auto* table = node.as_table()) {
        value.kind = Value::Kind::table;
        for (const auto& [key, child] : *table)
            value.members.push_back({std::string(key.str()), position(key.source()), convert(child)});
        // toml++ sorts by name; mistakes are reported in the order of the file.
        std::stable_sort(value.members.begin(), value.members.end(), [](const Member& a, const Member& b) {
            return std::pair(a.at.line, a.at.column) < std::pair(b.at.line, b.at.column);
        });
    } else if (const auto* array = node.as_array()) {
        value.kind = Value::Kind::array;
        for (const toml::node& child : *array)
            value.items.push_back(convert(child));
    } else if (const auto* text = node.as_string()) {
        value.kind = Value::Kind::string;
        value.string = text->get();
    } else if (const auto* whole = node.as_integer()) {
        value.kind = Value::Kind::integer;
        value.integer = whole->get();
    } else if (const auto* real = node.as_floating_point()) {
        value.kind = Value::Kind::real;
        value.real = real->get();
    } else if (const auto* flag = node.as_boolean()) {
        value.kind = Value::Kind::boolean;
        value.boolean = flag->get();
    } else {
        value.kind = Value::Kind::date;
    }
    return value;
}

/// Parts of the longest dotted key. toml++ 3.3 bounds nested arrays and inline tables, not the tables that a
/// dotted key nests, and goes through all of them by recursion.
constexpr std::size_t max_key_parts = 16;

/// Position behind the string that begins at `at`, or where a string that has no end breaks off.
std::size_t end_of_string(std::string_view text, std::size_t at) {
    const char quote = text[at];
    const std::string_view three = text.substr(at, 3);
    const bool several_lines = three.size() == 3 && three[1] == quote && three[2] == quote;
    at += several_lines ? 3 : 1;
    for (; at < text.size(); ++at) {
        if (text[at] == '\\' && quote == '"') {
            ++at;
        } else if (text[at] == '\n' && !several_lines) {
            return at;
        } else if (text[at] == quote) {
            if (!several_lines) return at + 1;
            if (text.substr(at, 3) != three) continue;
            at += 3;
            // Up to two quotes may precede the three that end the string.
            for (int more = 0; more < 2 && at < text.size() && text[at] == quote; ++more)
                ++at;
            return at;
        }
    }
    return text.size();
}

/// Throws ConfigError for a key of more than max_key_parts parts.
void check_dotted_keys(std::string_view text, const std::string& name) {
    constexpr std::string_view between_dots =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_- \t";
    std::size_t dots = 0; // of the key, or number, so far
    for (std::size_t at = 0; at < text.size();) {
        const char c = text[at];
        if (c == '"' || c == '\'') {
            at = end_of_string(text, at);
            continue;
        }
        if (c == '#') {
            at = std::min(text.find('\n', at), text.size());
            continue;
        }
        if (c != '.' && between_dots.find(c) == std::string_view::npos) dots = 0;
        if (c == '.' && ++dots == max_key_parts) {
            const std::string_view before = text.substr(0, at);
            const auto line = 1 + std::count(before.begin(), before.end(), '\n');
            const std::size_t end_of_last = before.rfind('\n');
            const std::size_t column = end_of_last == std::string_view::npos ? at + 1 : at - end_of_last;
            throw ConfigError(fmt::format("{}:{}:{}: not valid TOML: a key has more than {} parts", name,
                                          line, column, max_key_parts));
        }
        ++at;
    }
}

} // namespace

const Member* Value::find(std::string_view key) const {
    const auto it =
        std::find_if(members.begin(), members.end(), [&](const Member& m) { return m.key == key; });
    return it == members.end() ? nullptr : &*it;
}

std::string_view kind_name(Value::Kind kind) {
    switch (kind) {
    case Value::Kind::boolean:
        return "a boolean";
    case Value::Kind::integer:
        return "an integer";
    case Value::Kind::real:
        return "a number";
    case Value::Kind::string:
        return "a string";
    case Value::Kind::date:
        return "a date or time";
    case Value::Kind::array:
        return "an array";
    case Value::Kind::table:
        break;
    }
    return "a table";
}

std::string read_text(const std::filesystem::path& file, std::string& text) {
    return read_plain_text(file, std::size_t{64} << 20, text);
}

Value parse_text(std::string_view text, const std::string& name) {
    check_dotted_keys(text, name);
    try {
        return convert(toml::parse(text, name));
    } catch (const toml::parse_error& error) {
        const Position at = position(error.source());
        throw ConfigError(fmt::format("{}:{}:{}: not valid TOML: {}", name, at.line, at.column,
                                      printable(error.description(), 300)));
    }
}

Value parse_file(const std::filesystem::path& file) {
    std::string text;
    if (const std::string why = read_text(file, text); !why.empty())
        throw ConfigError(fmt::format("{}: cannot be opened: {}", file.string(), why),
                          errno != 0 ? errno : EISDIR);
    return parse_text(text, file.string());
}

} // namespace obscura::config
