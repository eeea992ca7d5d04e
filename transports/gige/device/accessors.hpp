// SPDX-License-Identifier: Apache-2.0
// Getters and setters for rows of the feature table that show a member of the camera's settings or limits.
#pragma once

#include "transports/gige/device/device_context.hpp"
#include "transports/gige/device/feature_table.hpp"
#include "transports/gige/registers/feature.hpp"

#include <array>
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

/// `member` of CameraSettings.
template<auto member>
std::uint64_t get_setting(const Feature& f, DeviceContext& d, std::uint32_t /*index*/) {
    return encode(f, d.control.settings().*member);
}
template<auto member>
Status set_setting(const Feature& f, DeviceContext& d, std::uint32_t /*index*/, std::uint32_t word) {
    CameraSettings wanted = d.control.settings();
    decode(f, word, wanted.*member);
    return apply_settings(d, wanted);
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
