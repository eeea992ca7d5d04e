// SPDX-License-Identifier: Apache-2.0
// Enumeration name tables, as written in files, on command lines and in GenICam descriptions.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

namespace obscura {

/// One value of an enumeration and its name.
template<typename Enum>
struct EnumName {
    Enum value;
    std::string_view name;
};
/// Clang before 17 does not deduce the arguments of aggregates by itself.
template<typename Enum>
EnumName(Enum, std::string_view) -> EnumName<Enum>;

/// An enumeration that has names declares them once, beside itself:
///     enum class LatePolicy : std::uint8_t { late, repeat };
///     constexpr auto enum_names(LatePolicy /*type*/) {
///         return std::array{EnumName{LatePolicy::late, "late"}, EnumName{LatePolicy::repeat, "repeat"}};
///     }
template<typename Enum>
concept NamedEnum = requires(Enum value) {
    enum_names(value);
};

/// The name of `value`; empty for a value without one.
template<NamedEnum Enum>
[[nodiscard]] constexpr std::string_view name_of(Enum value) {
    for (const EnumName<Enum>& row : enum_names(value))
        if (row.value == value) return row.name;
    return {};
}

/// The value named `name`, if there is one.
template<NamedEnum Enum>
[[nodiscard]] constexpr std::optional<Enum> enum_named(std::string_view name) {
    for (const EnumName<Enum>& row : enum_names(Enum{}))
        if (row.name == name) return row.value;
    return std::nullopt;
}

/// All names, in the order of the table.
template<NamedEnum Enum>
[[nodiscard]] std::vector<std::string_view> names_of_enum() {
    std::vector<std::string_view> names;
    for (const EnumName<Enum>& row : enum_names(Enum{}))
        names.push_back(row.name);
    return names;
}

} // namespace obscura
