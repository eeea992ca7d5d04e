// SPDX-License-Identifier: Apache-2.0
#include "host/setting_text.hpp"

#include "core/text/printable.hpp"
#include "core/text/suggestion.hpp"
#include "host/command_line.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstdint>

namespace obscura::host {
namespace {

/// The number that the whole of `text` is; `value` is untouched if it is none.
template<typename Number>
bool is_number(std::string_view text, Number& value) {
    Number read{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), read);
    if (error != std::errc{} || end != text.data() + text.size()) return false;
    value = read;
    return true;
}

} // namespace

std::string plain_text(const CallJson& value) {
    if (value.is_string()) return for_terminal(value.get<std::string>());
    if (value.is_number_float()) return fmt::format("{}", value.get<double>());
    return value.dump(-1, ' ', false, CallJson::error_handler_t::replace);
}

CallJson value_of_text(std::string_view text) {
    if (text == "true" || text == "false") return text == "true";
    if (std::int64_t whole = 0; is_number(text, whole)) return whole;
    if (double number = 0; is_number(text, number) && std::isfinite(number)) return number;
    return text;
}

CallJson assignments(std::string_view verb, const std::vector<std::string>& words) {
    CallJson map = CallJson::object();
    for (const std::string& word : words) {
        const std::size_t sign = word.find('=');
        if (sign == 0 || sign == std::string::npos)
            throw UsageError(
                fmt::format("obscura {}: \"{}\" is not NAME=VALUE, for example ExposureTime=5000", verb,
                            word.substr(0, 60)));
        const std::string name = word.substr(0, sign);
        if (map.contains(name)) throw UsageError(fmt::format("obscura {}: {} is given twice", verb, name));
        map[name] = value_of_text(std::string_view(word).substr(sign + 1));
    }
    return map;
}

void require_member(std::string_view verb, const CallJson& map, const std::string& name) {
    if (map.contains(name)) return;
    std::vector<std::string_view> known;
    for (const auto& [key, value] : map.items())
        known.push_back(key);
    throw CallError("bad-argument", fmt::format("obscura {}: no setting \"{}\", {}", verb, name.substr(0, 60),
                                                suggestion(name, known)));
}

} // namespace obscura::host
