// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene/kind.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <cctype>
#include <cmath>
#include <type_traits>

namespace obscura::scene {
namespace {

/// Name of a key for messages, with spaces instead of underscores.
std::string words_of(std::string_view name) {
    std::string words(name);
    std::replace(words.begin(), words.end(), '_', ' ');
    return words;
}

/// Suffix of keys with a unit: "_w_m2_sr" for "W m-2 sr-1".
std::string ending_of(std::string_view unit) {
    std::string name(1, '_');
    for (std::size_t i = 0; i < unit.size(); ++i) {
        const char c = unit[i];
        if (c == '-') {
            if (i + 1 < unit.size() && unit[i + 1] == '1') ++i;
            continue;
        }
        name += c == '/' || c == ' ' ? '_' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    return name;
}

/// SI unit of a quantity that files give in `unit`.
std::string_view si_unit(std::string_view unit) {
    if (unit == "deg") return "rad";
    if (unit == "mm" || unit == "um" || unit == "nm") return "m";
    return unit;
}

/// All numbers of a key's value.
std::vector<double> numbers_of(const config::Target& target) {
    return std::visit(
        [](const auto& t) -> std::vector<double> {
            using T = std::decay_t<decltype(t)>;
            if constexpr (std::is_same_v<T, Vec3*>)
                return {t->x, t->y, t->z};
            else if constexpr (std::is_same_v<T, Quat*>)
                return {t->w, t->x, t->y, t->z};
            else if constexpr (std::is_same_v<T, config::Scaled>)
                return {*t.value};
            else if constexpr (std::is_same_v<T, config::Numbers>)
                return {t.first, t.first + t.count};
            else if constexpr (std::is_same_v<T, std::vector<double>*>)
                return *t;
            else if constexpr (std::is_same_v<T, config::Curve>) {
                std::vector<double> values;
                for (const SpectralPoint& p : *t.points)
                    values.push_back(p.value);
                return values;
            } else if constexpr (std::is_same_v<T, config::Faces>) {
                std::vector<double> values;
                for (const auto& face : *t.faces)
                    for (const Vec3 p : face)
                        values.insert(values.end(), {p.x, p.y, p.z});
                return values;
            } else if constexpr (std::is_same_v<T, bool*> || std::is_same_v<T, std::string*> ||
                                 std::is_same_v<T, config::Path> || std::is_same_v<T, config::Files> ||
                                 std::is_same_v<T, config::Word>)
                return {};
            else
                return {static_cast<double>(*t)};
        },
        target);
}

} // namespace

config::Keys keys_of(const ParameterList& parameters) {
    config::Keys keys;
    for (const Parameter& parameter : parameters)
        keys.push_back(parameter.key);
    return keys;
}

std::string_view quantity_of(const config::Key& key) {
    const std::string end = ending_of(key.unit());
    std::string_view name = key.name;
    if (end.size() > 1 && name.size() > end.size() && name.ends_with(end)) name.remove_suffix(end.size());
    return name;
}

void check_ranges(const config::Keys& keys, const std::string& place) {
    for (const config::Key& key : keys) {
        const auto* scaled = std::get_if<config::Scaled>(&key.target);
        const double si = scaled != nullptr ? scaled->si : 1;
        const std::vector<double> numbers = numbers_of(key.target);
        const auto bad = std::find_if(numbers.begin(), numbers.end(), [&](double v) {
            return !(std::isfinite(v) && v >= key.range().min * si && v <= key.range().max * si);
        });
        if (bad == numbers.end()) continue;
        const bool vector = std::holds_alternative<Vec3*>(key.target);
        const std::string value =
            vector ? fmt::format("{}", fmt::join(numbers, " ")) : fmt::format("{}", *bad);
        const std::string_view unit = scaled != nullptr ? si_unit(key.unit()) : key.unit();
        const std::string suffix = unit.empty() ? "" : fmt::format(" {}", unit);
        // Ranges are round numbers in the unit of the file; in SI four digits suffice.
        const std::string allowed =
            scaled != nullptr
                ? fmt::format("{:.4g} to {:.4g}{}", key.range().min * si, key.range().max * si, suffix)
                : allowed_text(key);
        throw ConfigError(fmt::format("{}: {} {}{}: allowed {}", place, words_of(quantity_of(key)), value,
                                      suffix, allowed.empty() ? "are finite numbers" : allowed));
    }
}

void refuse_conflicts(const std::vector<Conflict>& conflicts, const config::Keys& keys,
                      const std::string& place) {
    if (conflicts.empty()) return;
    const Conflict& first = conflicts.front();
    std::string_view name = first.key;
    for (const config::Key& key : keys)
        if (key.name == first.key) name = quantity_of(key);
    throw ConfigError(fmt::format("{}: {} {}", place, words_of(name), first.what));
}

} // namespace obscura::scene
