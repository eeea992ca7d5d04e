// SPDX-License-Identifier: Apache-2.0
#include "service/compatible/arguments.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::service::compatible {
namespace {

std::string_view words_of(ArgumentType type) {
    switch (type) {
    case ArgumentType::text:
        return "a string";
    case ArgumentType::number:
        return "a number";
    case ArgumentType::integer:
        return "a whole number";
    case ArgumentType::flag:
        return "true or false";
    case ArgumentType::vector:
        return "a list of numbers";
    case ArgumentType::list:
        return "a list";
    case ArgumentType::bytes:
        return "bytes";
    case ArgumentType::any:
        break;
    }
    return "a value";
}

/// The largest whole number that doubles hold with all below it.
constexpr double largest_whole = 9007199254740992.0;

bool to_integer(const Value& value, std::int64_t& out) {
    double number = 0;
    if (!to_number(value, number) || number != std::floor(number) || std::abs(number) > largest_whole)
        return false;
    out = static_cast<std::int64_t>(number);
    return true;
}

bool fits(ArgumentType type, const Value& value) {
    double number = 0;
    std::int64_t whole = 0;
    std::vector<double> numbers;
    switch (type) {
    case ArgumentType::text:
        return value.as<std::string>() != nullptr;
    case ArgumentType::number:
        return to_number(value, number);
    case ArgumentType::integer:
    case ArgumentType::flag:
        return to_integer(value, whole);
    case ArgumentType::vector:
        return to_numbers(value, numbers);
    case ArgumentType::list:
        return value.as<List>() != nullptr;
    case ArgumentType::bytes:
        return value.as<Bytes>() != nullptr;
    case ArgumentType::any:
        break;
    }
    return true;
}

} // namespace

bool to_number(const Value& value, double& out) noexcept {
    if (const auto* flag = value.as<bool>()) return out = *flag ? 1 : 0, true;
    if (const auto* number = value.as<std::int32_t>()) return out = *number, true;
    if (const auto* number = value.as<std::uint32_t>()) return out = *number, true;
    if (const auto* number = value.as<std::uint64_t>()) return out = static_cast<double>(*number), true;
    if (const auto* number = value.as<double>()) return out = *number, true;
    return false;
}

bool to_numbers(const Value& value, std::vector<double>& out) {
    const List* const list = value.as<List>();
    if (list == nullptr) return false;
    out.resize(list->size());
    for (std::size_t i = 0; i < out.size(); ++i)
        if (!to_number((*list)[i], out[i])) return false;
    return true;
}

Arguments::Arguments(const Command& command, const Fields& message) : command_(command), message_(message) {
    for (const Argument& argument : command.arguments) {
        const Value* const value = find(message, argument.name);
        if (value == nullptr && !argument.optional)
            throw refused(argument.name, "is missing", std::string(words_of(argument.type)));
        if (value != nullptr && !fits(argument.type, *value))
            throw refused(argument.name, "is of another type", std::string(words_of(argument.type)));
    }
}

Failure Arguments::refused(std::string_view name, const std::string& what, const std::string& allowed) const {
    return bad_argument(name,
                        fmt::format("{}: {}: {}{}{}", command_.name, name, what,
                                    allowed.empty() ? "" : ", allowed ", allowed),
                        allowed);
}

bool Arguments::has(std::string_view name) const {
    return find(message_, name) != nullptr;
}

const Value& Arguments::value(std::string_view name) const {
    const Value* const found = find(message_, name);
    if (found == nullptr) throw refused(name, "is missing", {});
    return *found;
}

const std::string& Arguments::text(std::string_view name) const {
    const auto* const text = value(name).as<std::string>();
    if (text == nullptr) throw refused(name, "is of another type", "a string");
    if (text->find('\0') != std::string::npos) throw refused(name, "has a NUL character", "text");
    return *text;
}

bool Arguments::flag(std::string_view name) const {
    double number = 0;
    if (!to_number(value(name), number)) throw refused(name, "is of another type", "true or false");
    return number != 0;
}

double Arguments::number(std::string_view name) const {
    double number = 0;
    if (!to_number(value(name), number) || !std::isfinite(number))
        throw refused(name, "is no finite number", "a finite number");
    return number;
}

double Arguments::number(std::string_view name, double least, double most) const {
    const double got = number(name);
    if (!(got >= least && got <= most))
        throw refused(name, fmt::format("{} is out of range", got), fmt::format("{} to {}", least, most));
    return got;
}

std::int64_t Arguments::integer(std::string_view name, std::int64_t least, std::int64_t most) const {
    std::int64_t got = 0;
    if (!to_integer(value(name), got)) throw refused(name, "is no whole number", "a whole number");
    if (got < least || got > most)
        throw refused(name, fmt::format("{} is out of range", got), fmt::format("{} to {}", least, most));
    return got;
}

std::vector<double> Arguments::vector(std::string_view name, std::size_t count) const {
    std::vector<double> numbers;
    if (!to_numbers(value(name), numbers)) throw refused(name, "is no list of numbers", "a list of numbers");
    if (numbers.size() != count)
        throw refused(name, fmt::format("{} numbers", numbers.size()), fmt::format("{}", count));
    if (!std::all_of(numbers.begin(), numbers.end(), [](double n) { return std::isfinite(n); }))
        throw refused(name, "has a number that is not finite", "finite numbers");
    return numbers;
}

const std::string& Arguments::bytes(std::string_view name) const {
    const auto* const found = value(name).as<Bytes>();
    if (found == nullptr) throw refused(name, "is of another type", "bytes");
    return found->data;
}

} // namespace obscura::service::compatible
