// SPDX-License-Identifier: Apache-2.0
#include "instrument/scpi/parameters.hpp"

#include "core/overloaded.hpp"
#include "core/text/suggestion.hpp"
#include "instrument/scpi/errors.hpp"
#include "instrument/scpi/header_pattern.hpp"
#include "instrument/scpi/text.hpp"

#include <fmt/format.h>
#include <strings.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <system_error>
#include <utility>

namespace obscura::instrument {
namespace {

/// Factor of a unit or suffix to the SI unit of its quantity.
struct UnitRow {
    std::string_view suffix; ///< in upper case, as IEEE 488.2 compares it
    char quantity;
    double factor;
};
// MHZ is a megahertz: IEEE 488.2, 7.7.3.3.
constexpr std::array<UnitRow, 8> units{{{"S", 't', 1},
                                        {"MS", 't', 1e-3},
                                        {"US", 't', 1e-6},
                                        {"NS", 't', 1e-9},
                                        {"HZ", 'f', 1},
                                        {"KHZ", 'f', 1e3},
                                        {"MHZ", 'f', 1e6},
                                        {"DB", 'g', 1}}};

const UnitRow* unit_named(std::string_view name) {
    for (const UnitRow& row : units)
        if (row.suffix.size() == name.size() && strncasecmp(row.suffix.data(), name.data(), name.size()) == 0)
            return &row;
    return nullptr;
}

double per_base_unit(const Feature& feature) {
    return base_unit_of(feature.unit).per_unit;
}

double number_for(const Feature& feature, const Parameter& parameter, PlainNumbers numbers) {
    if (parameter.suffix.empty())
        return numbers == PlainNumbers::base_unit ? parameter.number * per_base_unit(feature)
                                                  : parameter.number;
    const UnitRow* const own = unit_named(feature.unit);
    if (own == nullptr) throw ScpiError(ScpiCode::suffix_not_allowed, parameter.suffix);
    const UnitRow* const given = unit_named(parameter.suffix);
    if (given == nullptr || given->quantity != own->quantity)
        throw ScpiError(ScpiCode::invalid_suffix, parameter.suffix);
    return parameter.number * given->factor * per_base_unit(feature);
}

/// The numbers of "1 to 1e7 us".
struct Limits {
    double minimum, maximum;
};
std::optional<Limits> limits_of(const std::string& allowed) {
    Limits limits{};
    const char* const end = allowed.data() + allowed.size();
    const auto first = std::from_chars(allowed.data(), end, limits.minimum);
    constexpr std::string_view between = " to ";
    if (first.ec != std::errc{} || std::string_view(first.ptr, end).substr(0, between.size()) != between)
        return std::nullopt;
    if (std::from_chars(first.ptr + between.size(), end, limits.maximum).ec != std::errc{})
        return std::nullopt;
    return limits;
}

bool is_number(const FeatureValue& value) {
    return std::holds_alternative<double>(value) || std::holds_alternative<std::int64_t>(value);
}

/// A number of the kind that the feature has.
FeatureValue number_like(const Feature& feature, double number) {
    if (std::holds_alternative<double>(feature.value)) return number;
    constexpr double largest = 9e15; // whole in a double
    if (!(std::abs(number) <= largest))
        throw ScpiError(ScpiCode::data_out_of_range, fmt::format("{}: {}", feature.name, feature.allowed));
    return static_cast<std::int64_t>(std::llround(number));
}

std::optional<double> extreme(const Feature& feature, const Parameter& parameter) {
    if (parameter.kind != Parameter::Kind::word || !is_number(feature.value)) return std::nullopt;
    const bool minimum = is_form_of(parameter.text, "MINimum");
    if (!minimum && !is_form_of(parameter.text, "MAXimum")) return std::nullopt;
    const std::optional<Limits> limits = limits_of(feature.allowed);
    if (!limits)
        throw ScpiError(ScpiCode::illegal_parameter_value, fmt::format("{} has no limits", feature.name));
    return minimum ? limits->minimum : limits->maximum;
}

/// The one of the feature's words that was given, in whatever case.
std::string choice_of(const Feature& feature, const std::string& given) {
    std::string_view rest = feature.allowed;
    constexpr std::string_view between = " | ";
    if (rest.empty()) return given;
    std::vector<std::string_view> words;
    while (!rest.empty()) {
        const std::string_view word = rest.substr(0, rest.find(between));
        words.push_back(word);
        if (word.size() == given.size() && strncasecmp(word.data(), given.data(), word.size()) == 0)
            return std::string(word);
        rest.remove_prefix(word.size());
        if (!rest.empty()) rest.remove_prefix(between.size());
    }
    throw ScpiError(ScpiCode::illegal_parameter_value,
                    fmt::format("{}: {}", feature.name, allowed_words(given, words)));
}

} // namespace

BaseUnit base_unit_of(std::string_view unit) {
    const UnitRow* const own = unit_named(unit);
    if (own == nullptr) return {unit, 1};
    constexpr std::array<std::pair<char, std::string_view>, 3> bases{{{'t', "s"}, {'f', "Hz"}, {'g', "dB"}}};
    const auto* const base =
        std::find_if(bases.begin(), bases.end(), [&](const auto& row) { return row.first == own->quantity; });
    // Whole, so that decimal numbers stay exact.
    return {base->second, std::round(1 / own->factor)};
}

std::uint32_t integer_of(const Parameter& parameter, std::uint32_t most) {
    if (parameter.kind != Parameter::Kind::number) throw ScpiError(ScpiCode::data_type_error, parameter.text);
    if (!parameter.suffix.empty()) throw ScpiError(ScpiCode::suffix_not_allowed, parameter.suffix);
    const double whole = std::round(parameter.number);
    if (!(whole >= 0 && whole <= most))
        throw ScpiError(ScpiCode::data_out_of_range, fmt::format("{}: 0 to {}", parameter.text, most));
    return static_cast<std::uint32_t>(whole);
}

const std::string& string_of(const Parameter& parameter) {
    if (parameter.kind != Parameter::Kind::string)
        throw ScpiError(ScpiCode::data_type_error, "a string in quotes is wanted");
    return parameter.text;
}

FeatureValue value_for(const Feature& feature, const Parameter& parameter, PlainNumbers numbers) {
    if (const auto limit = extreme(feature, parameter)) return number_like(feature, *limit);
    const bool is_numeric = parameter.kind == Parameter::Kind::number;
    if (std::holds_alternative<bool>(feature.value)) {
        if (is_numeric) {
            if (!parameter.suffix.empty()) throw ScpiError(ScpiCode::suffix_not_allowed, parameter.suffix);
            return std::round(parameter.number) != 0;
        }
        const bool on = is_form_of(parameter.text, "ON");
        if (!on && !is_form_of(parameter.text, "OFF"))
            throw ScpiError(ScpiCode::illegal_parameter_value, fmt::format("{}: ON or OFF", feature.name));
        return on;
    }
    if (is_number(feature.value)) {
        if (!is_numeric)
            throw ScpiError(ScpiCode::data_type_error, fmt::format("{}: a number", feature.name));
        return number_like(feature, number_for(feature, parameter, numbers));
    }
    if (is_numeric) throw ScpiError(ScpiCode::data_type_error, fmt::format("{}: a word", feature.name));
    return choice_of(feature, parameter.text);
}

FeatureValue limit_of(const Feature& feature, const Parameter& parameter) {
    const auto limit = extreme(feature, parameter);
    if (!limit)
        throw ScpiError(ScpiCode::illegal_parameter_value, fmt::format("{}: MIN or MAX", feature.name));
    return number_like(feature, *limit);
}

std::string response_of(const Feature& feature, const FeatureValue& value, PlainNumbers numbers) {
    const bool base = numbers == PlainNumbers::base_unit;
    const double scale = base ? per_base_unit(feature) : 1;
    return std::visit(Overloaded{[](bool on) { return std::string(on ? "1" : "0"); },
                                 [&](std::int64_t number) {
                                     return scale == 1 ? fmt::format("{}", number)
                                                       : number_text(static_cast<double>(number) / scale);
                                 },
                                 [&](double number) { return number_text(number / scale); },
                                 [&](const std::string& word) { return base ? word : string_data(word); }},
                      value);
}

} // namespace obscura::instrument
