// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/registers/feature.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::transports::gige {
namespace {

constexpr std::int64_t ns_per_us = 1000;

} // namespace

const Feature* find_feature(std::span<const FeatureCategory> table, std::string_view name) {
    for (const FeatureCategory& category : table)
        for (const Feature& feature : category.features)
            if (feature.name == name) return &feature;
    return nullptr;
}

std::uint32_t item_count(const Feature& selector) {
    std::uint32_t largest = static_cast<std::uint32_t>(selector.maximum.fixed.value_or(0));
    for (const FeatureEntry& entry : selector.entries)
        largest = std::max(largest, entry.value);
    return largest + 1;
}

bool in_range(const Feature& f, std::uint32_t word) {
    switch (f.type) {
    case FeatureType::boolean:
        return word <= 1;
    case FeatureType::enumeration:
        return std::any_of(f.entries.begin(), f.entries.end(),
                           [&](const FeatureEntry& entry) { return entry.value == word; });
    default: {
        const double value = f.is_signed ? static_cast<double>(static_cast<std::int32_t>(word)) : word;
        return value >= std::round(f.minimum.fixed.value_or(-INFINITY) * f.scale) &&
               value <= std::round(f.maximum.fixed.value_or(INFINITY) * f.scale);
    }
    }
}

std::uint32_t smallest_word(const Feature& f) {
    return static_cast<std::uint32_t>(std::llround(f.minimum.fixed.value_or(0) * f.scale));
}

std::uint32_t largest_word(const Feature& f) {
    return f.maximum.fixed ? static_cast<std::uint32_t>(std::llround(*f.maximum.fixed * f.scale))
                           : UINT32_MAX;
}

std::uint32_t to_word(const Feature& f, double value) {
    return static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lround(value * f.scale)));
}

double from_word(const Feature& f, std::uint32_t word) {
    return static_cast<double>(static_cast<std::int32_t>(word)) / f.scale;
}

std::uint32_t duration_to_word(const Feature& f, std::int64_t ns) {
    const std::int64_t ns_per_word = ns_per_us / static_cast<std::int64_t>(f.scale);
    return static_cast<std::uint32_t>(std::clamp<std::int64_t>(ns / ns_per_word, 0, UINT32_MAX));
}

std::int64_t duration_from_word(const Feature& f, std::uint32_t word) {
    return std::int64_t{word} * (ns_per_us / static_cast<std::int64_t>(f.scale));
}

} // namespace obscura::transports::gige
