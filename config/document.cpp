// SPDX-License-Identifier: Apache-2.0
// Only this translation unit includes toml++.
#include "config/document.hpp"

#include "core/error.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

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

std::string printable(std::string_view text, std::size_t limit) {
    std::string out;
    for (const char c : text.substr(0, limit))
        out += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? ' ' : c;
    if (text.size() > limit) out += "...";
    return out;
}

std::string read_text(const std::filesystem::path& file, std::string& text) {
    constexpr std::size_t limit = std::size_t{64} << 20;
    const auto close = [](std::FILE* f) { std::fclose(f); };
    const std::unique_ptr<std::FILE, decltype(close)> in(std::fopen(file.c_str(), "rbe"), close);
    if (!in) return std::strerror(errno);
    struct stat facts {};
    if (fstat(fileno(in.get()), &facts) != 0) return std::strerror(errno);
    // Reading a directory, device or pipe could block or never end.
    if (!S_ISREG(facts.st_mode)) return "not a regular file";
    if (static_cast<std::size_t>(facts.st_size) > limit) return "larger than 64 MiB";
    text.resize(static_cast<std::size_t>(facts.st_size));
    text.resize(std::fread(text.data(), 1, text.size(), in.get()));
    if (std::ferror(in.get()) != 0) return std::strerror(errno);
    return {};
}

Value parse_text(std::string_view text, const std::string& name) {
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
        throw ConfigError(fmt::format("{}: cannot be opened: {}", file.string(), why));
    return parse_text(text, file.string());
}

} // namespace obscura::config
