// SPDX-License-Identifier: Apache-2.0
// One camera setting: what a row of the setting table holds, and the makers of its parts.
#pragma once

#include "core/camera/camera.hpp"
#include "core/text/enum_names.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>

namespace obscura {

/// Smallest and largest value, both allowed, in the setting's unit. A value that is not a number lies in no
/// range.
struct SettingRange {
    double minimum = 0, maximum = 0;
    [[nodiscard]] constexpr bool contains(double value) const { return value >= minimum && value <= maximum; }
    constexpr bool operator==(const SettingRange&) const = default;
};

/// A value of an enumeration and its name.
struct SettingWord {
    std::string_view name;
    std::uint32_t value;
};

enum class SettingType : std::uint8_t { integer, floating, boolean, enumeration };

/// When a setting cannot be changed.
enum class SettingLock : std::uint8_t {
    never,
    streaming, ///< while the camera acquires
};

/// Access to one member of CameraSettings as a number: of an enumeration its value, of a duration in ns the
/// microseconds.
struct SettingMember {
    SettingType type;
    bool is_duration;                   ///< std::int64_t in ns
    std::span<const SettingWord> words; ///< of an enumeration
    double (*get)(const CameraSettings& settings);
    void (*set)(CameraSettings& settings, double value);
};

/// One camera setting. Real-time safe.
struct Setting {
    std::string_view name;     ///< of SFNC, or of its kind where SFNC has none
    std::string_view category; ///< of SFNC
    SettingMember member;
    std::string_view unit = {};
    std::optional<SettingRange> range = {}; ///< the same for every camera
    /// In place of `range`, for one that depends on the camera.
    SettingRange (*range_in)(const CameraLimits& limits) = nullptr;
    std::int32_t CameraLimits::*increment = nullptr;
    SettingLock lock = SettingLock::never;
    bool per_window = false; ///< each window has its own; the member is that of the first one
    std::string_view help;   ///< a full phrase without unit, range and lock

    [[nodiscard]] constexpr std::optional<SettingRange> range_of(const CameraLimits& limits) const {
        return range_in != nullptr ? std::optional(range_in(limits)) : range;
    }
    /// Name of a value of an enumeration; empty for one without.
    [[nodiscard]] constexpr std::string_view word_of(double value) const {
        for (const SettingWord& word : member.words)
            if (word.value == value) return word.name;
        return {};
    }
    [[nodiscard]] constexpr bool is_locked(bool acquiring) const {
        return acquiring && lock == SettingLock::streaming;
    }
};

/// Durations are kept in ns and set in us.
constexpr double ns_per_setting_unit = 1e3;

namespace setting_detail {

template<NamedEnum Enum>
constexpr auto words() {
    constexpr auto names = enum_names(Enum{});
    std::array<SettingWord, names.size()> words{};
    std::transform(names.begin(), names.end(), words.begin(), [](const EnumName<Enum>& row) {
        return SettingWord{row.name, static_cast<std::uint32_t>(row.value)};
    });
    return words;
}
template<NamedEnum Enum>
inline constexpr auto words_of = words<Enum>();

inline constexpr std::array on_off{SettingWord{"On", 1}, SettingWord{"Off", 0}};

// `path`: a pointer to a member of CameraSettings, one to a member of that, and so on. The operator between
// them is a fold over .*
template<auto... path>
using Member = std::remove_cvref_t<decltype((std::declval<CameraSettings&>().*....*path))>;

template<auto... path>
double get(const CameraSettings& settings) {
    const double value = static_cast<double>((settings.*....*path));
    return std::is_same_v<Member<path...>, std::int64_t> ? value / ns_per_setting_unit : value;
}
template<auto... path>
void set(CameraSettings& settings, double value) {
    using T = Member<path...>;
    if constexpr (std::is_same_v<T, std::int64_t>) {
        (settings.*....*path) = std::llround(value * ns_per_setting_unit);
    } else if constexpr (std::is_enum_v<T>) {
        (settings.*....*path) = static_cast<T>(static_cast<std::uint32_t>(value));
    } else {
        (settings.*....*path) = static_cast<T>(value);
    }
}

template<typename T>
constexpr SettingType type_of() {
    if (std::is_enum_v<T>) return SettingType::enumeration;
    if (std::is_same_v<T, bool>) return SettingType::boolean;
    return std::is_same_v<T, double> || std::is_same_v<T, std::int64_t> ? SettingType::floating
                                                                        : SettingType::integer;
}

/// The member at the end of `path` of pointers to members.
template<auto... path>
constexpr SettingMember member() {
    using T = Member<path...>;
    std::span<const SettingWord> words;
    if constexpr (std::is_enum_v<T>) words = words_of<T>;
    return {type_of<T>(), std::is_same_v<T, std::int64_t>, words, get<path...>, set<path...>};
}
/// A member that is a boolean, whose values SFNC calls On and Off.
template<auto... path>
constexpr SettingMember on_off_member() {
    return {SettingType::enumeration, false, on_off, get<path...>, set<path...>};
}

/// The numbers in two members of CameraLimits, in the setting's unit.
template<auto minimum, auto maximum>
SettingRange limits_in(const CameraLimits& limits) {
    const bool durations = std::is_same_v<std::remove_cvref_t<decltype(limits.*minimum)>, std::int64_t>;
    const double per_unit = durations ? ns_per_setting_unit : 1;
    return {static_cast<double>(limits.*minimum) / per_unit, static_cast<double>(limits.*maximum) / per_unit};
}
/// Offsets on a sensor of that extent.
template<auto extent>
SettingRange offsets_in(const CameraLimits& limits) {
    return {0, static_cast<double>(limits.*extent - 1)};
}

} // namespace setting_detail

} // namespace obscura
