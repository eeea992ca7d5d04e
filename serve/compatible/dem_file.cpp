// SPDX-License-Identifier: Apache-2.0
#include "serve/compatible/dem_file.hpp"

#include "config/document.hpp"
#include "core/error.hpp"
#include "core/text/printable.hpp"
#include "core/text/text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>

namespace obscura::serve {
namespace {

constexpr std::size_t max_keys = 1000;
constexpr std::string_view blanks = " \t\r";

DemFile::Value value_of(std::string_view text) {
    if (text.size() >= 2 && text.front() == '"' && text.back() == '"')
        return std::string(text.substr(1, text.size() - 2));
    double number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error == std::errc() && end == text.data() + text.size() && std::isfinite(number)) return number;
    return std::string(text);
}

} // namespace

DemFile DemFile::read(const std::filesystem::path& file) {
    std::string text;
    if (const std::string why = config::read_text(file, text); !why.empty())
        throw InputError(fmt::format("{}: {}", file.string(), why));
    return parse(text, file.string());
}

DemFile DemFile::parse(std::string_view text, const std::string& name) {
    DemFile made;
    made.name_ = name;
    for (std::size_t line = 1; !text.empty(); ++line) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        std::string_view row = trimmed(text.substr(0, end), blanks);
        text.remove_prefix(std::min(end + 1, text.size()));
        if (row.empty() || row.starts_with('#') || row.starts_with("//") || row.starts_with("--")) continue;
        if (row.ends_with(';')) row = trimmed(row.substr(0, row.size() - 1), blanks);
        const std::size_t equals = row.find('=');
        const std::string_view key = trimmed(row.substr(0, std::min(equals, row.size())));
        const std::string_view value =
            equals == std::string_view::npos ? std::string_view() : trimmed(row.substr(equals + 1), blanks);
        if (key.empty() || value.empty())
            throw InputError(
                fmt::format("{}:{}: \"{}\", wanted KEY = VALUE;", name, line, printable(row, 40)));
        if (made.keys_.size() == max_keys)
            throw InputError(fmt::format("{}:{}: more than {} keys", name, line, max_keys));
        made.keys_.emplace_back(key, value_of(value));
    }
    return made;
}

const DemFile::Value* DemFile::find(std::string_view key) const {
    const auto at =
        std::find_if(keys_.begin(), keys_.end(), [&](const auto& row) { return row.first == key; });
    return at == keys_.end() ? nullptr : &at->second;
}

std::optional<double> DemFile::number(std::string_view key) const {
    const Value* value = find(key);
    if (value == nullptr) return {};
    if (const auto* number = std::get_if<double>(value)) return *number;
    throw InputError(
        mistake(fmt::format("{}: \"{}\" is no number", key, printable(std::get<std::string>(*value), 40))));
}

std::string DemFile::text(std::string_view key) const {
    const Value* value = find(key);
    if (value == nullptr) return {};
    if (const auto* text = std::get_if<std::string>(value)) return *text;
    throw InputError(mistake(fmt::format("{}: a number, wanted a name", key)));
}

std::string DemFile::mistake(std::string_view what) const {
    return fmt::format("{}: {}", name_, what);
}

} // namespace obscura::serve
