// SPDX-License-Identifier: Apache-2.0
// Rows of the feature table for camera settings and limits: completion from the setting table, getters,
// setters.
#pragma once

#include "core/camera/setting_table.hpp"
#include "core/text/enum_names.hpp"
#include "transports/gige/device/device_context.hpp"
#include "transports/gige/device/feature_table.hpp"
#include "transports/gige/registers/feature.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <type_traits>

namespace obscura::transports::gige {

/// An enumerator as the word of its register.
template<typename T>
constexpr std::uint32_t value(T v) {
    return static_cast<std::uint32_t>(v);
}

/// `value` is a number or an enumerator whose number is the word of the register.
template<typename T>
constexpr FeatureEntry entry(std::string_view name, T v) {
    return {.name = name, .value = value(v)};
}
/// An enumerator under its own name. `available`: formula; `base` is added to its number.
template<NamedEnum Enum>
constexpr FeatureEntry entry(Enum v, std::string_view available = {}, std::uint32_t base = 0) {
    return {.name = name_of(v), .value = value(v) + base, .available = available};
}
/// All enumerators in the order of their names.
template<NamedEnum Enum>
constexpr auto entries_of() {
    constexpr auto names = enum_names(Enum{});
    std::array<FeatureEntry, names.size()> entries{};
    std::transform(names.begin(), names.end(), entries.begin(),
                   [](const EnumName<Enum>& row) { return entry(row.value); });
    return entries;
}

inline constexpr std::array off_on{entry("Off", 0), entry("On", 1)};

/// A member of settings as the word of its register: double by the row's scale, std::int64_t as a duration in
/// ns, other types unchanged.
template<typename T>
std::uint64_t encode(const Feature& f, T v) {
    if constexpr (std::is_same_v<T, double>) {
        return to_word(f, v);
    } else if constexpr (std::is_same_v<T, std::int64_t>) {
        return duration_to_word(f, v);
    } else {
        return value(v);
    }
}

template<typename T>
void decode(const Feature& f, std::uint32_t word, T& v) {
    if constexpr (std::is_same_v<T, double>) {
        v = from_word(f, word);
    } else if constexpr (std::is_same_v<T, std::int64_t>) {
        v = duration_from_word(f, word);
    } else {
        v = static_cast<T>(word);
    }
}

/// The row's setting.
inline std::uint64_t get_row_setting(const Feature& f, DeviceContext& d, std::uint32_t /*index*/) {
    const SettingMember& member = f.setting->member;
    const double value = member.get(d.control.settings());
    if (member.is_duration) return duration_to_word(f, std::llround(value * ns_per_setting_unit));
    return member.type == SettingType::floating ? to_word(f, value) : static_cast<std::uint32_t>(value);
}
inline Status set_row_setting(const Feature& f, DeviceContext& d, std::uint32_t /*index*/,
                              std::uint32_t word) {
    CameraSettings wanted = d.control.settings();
    const SettingMember& member = f.setting->member;
    const double value = member.is_duration
                             ? static_cast<double>(duration_from_word(f, word)) / ns_per_setting_unit
                             : from_word(f, word);
    member.set(wanted, member.type == SettingType::floating ? value : word);
    return apply_settings(d, wanted);
}
/// Limits of the row's setting in this camera; the shortest duration is rounded up, so that the word is
/// valid.
inline std::uint64_t get_row_minimum(const Feature& f, DeviceContext& d, std::uint32_t /*index*/) {
    const double minimum = f.setting->range_of(d.limits)->minimum;
    if (!f.setting->member.is_duration) return to_word(f, minimum);
    return duration_to_word(f, std::llround(minimum * ns_per_setting_unit) + duration_from_word(f, 1) - 1);
}
inline std::uint64_t get_row_maximum(const Feature& f, DeviceContext& d, std::uint32_t /*index*/) {
    const double maximum = f.setting->range_of(d.limits)->maximum;
    if (!f.setting->member.is_duration) return to_word(f, maximum);
    return duration_to_word(f, std::llround(maximum * ns_per_setting_unit));
}

/// `row` completed by what the setting table says of the setting that it names: type, unit, tooltip, range,
/// lock. The row keeps what it says itself, which is what only GenICam has; limits that depend on the camera
/// need its addresses. Getters and setters that it lacks are those of the setting.
consteval Feature of_setting(Feature row) {
    const Setting& setting = obscura::setting(row.name);
    constexpr std::array types{FeatureType::integer, FeatureType::floating, FeatureType::boolean,
                               FeatureType::enumeration}; // as SettingType
    row.setting = &setting;
    row.type = types[static_cast<std::size_t>(setting.member.type)];
    row.unit = setting.unit;
    row.tooltip = setting.help;
    if (setting.range) {
        row.minimum = fixed(setting.range->minimum);
        row.maximum = fixed(setting.range->maximum);
    }
    if (row.minimum.address != 0 && row.minimum.get == nullptr) row.minimum.get = get_row_minimum;
    if (row.maximum.address != 0 && row.maximum.get == nullptr) row.maximum.get = get_row_maximum;
    if (setting.lock == SettingLock::streaming) row.lock = FeatureLock::streaming;
    if (row.get == nullptr) row.get = get_row_setting;
    if (row.set == nullptr) row.set = set_row_setting;
    return row;
}

/// `member` of CameraLimits.
template<auto member>
std::uint64_t get_limit(const Feature& f, DeviceContext& d, std::uint32_t /*index*/) {
    return encode(f, d.limits.*member);
}

/// The word that a feature without getter stores; `name` must be in the table.
[[nodiscard]] inline std::uint32_t stored(const DeviceContext& d, std::string_view name,
                                          std::uint32_t index = 0) {
    return d.bank.peek(address_of(name, index));
}
inline void store(DeviceContext& d, std::string_view name, std::uint32_t index, std::uint32_t word) {
    d.bank.poke(address_of(name, index), word);
}

} // namespace obscura::transports::gige
