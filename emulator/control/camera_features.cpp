// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/camera_features.hpp"

#include "config/document.hpp"
#include "service/call.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace obscura::emulator {
namespace {

/// A key whose choices are the words of an enumeration; `value` is that of the chosen one.
config::Key word_key(const Setting& row, std::int64_t* value) {
    const auto set = [&row, value](std::string_view word) {
        for (const SettingWord& one : row.member.words)
            if (one.name == word) *value = one.value;
    };
    const auto get = [&row, value] { return std::string(row.word_of(static_cast<double>(*value))); };
    std::vector<std::string_view> words;
    for (const SettingWord& one : row.member.words)
        words.push_back(one.name);
    return config::key(row.name, config::Word{set, get}).choices(std::move(words));
}

} // namespace

CameraFeatures::CameraFeatures(const CameraSettings& settings) : settings_(settings) {
    for (std::size_t i = 0; i < values_.size(); ++i) {
        const double value = camera_settings_table[i].member.get(settings);
        values_[i] = {std::llround(value), value, value != 0};
    }
}

config::Keys CameraFeatures::keys(const CameraLimits& limits) {
    config::Keys keys;
    for (std::size_t i = 0; i < values_.size(); ++i) {
        const Setting& row = camera_settings_table[i];
        Value& value = values_[i];
        const auto bound = [&] {
            switch (row.member.type) {
            case SettingType::integer:
                return config::key(row.name, &value.integer);
            case SettingType::floating:
                return config::key(row.name, &value.floating);
            case SettingType::boolean:
                return config::key(row.name, &value.boolean);
            case SettingType::enumeration:
                break;
            }
            return word_key(row, &value.integer);
        };
        config::Key key = bound().unit(row.unit).help(help_with_lock(row));
        if (const std::optional<SettingRange> range = row.range_of(limits))
            key = std::move(key).range(range->minimum, range->maximum);
        keys.push_back(std::move(key));
    }
    return keys;
}

CameraSettings CameraFeatures::settings() const {
    CameraSettings settings = settings_;
    for (std::size_t i = 0; i < values_.size(); ++i) {
        const SettingMember& member = camera_settings_table[i].member;
        const Value& value = values_[i];
        switch (member.type) {
        case SettingType::integer:
        case SettingType::enumeration:
            member.set(settings, static_cast<double>(value.integer));
            break;
        case SettingType::floating:
            member.set(settings, value.floating);
            break;
        case SettingType::boolean:
            member.set(settings, value.boolean ? 1 : 0);
            break;
        }
    }
    return settings;
}

nlohmann::json values_of(const config::Keys& keys) {
    std::string text;
    for (const config::Key& key : keys)
        text += fmt::format("{} = {}\n", key.name, config::value_text(key));
    return service::json_of(config::parse_text(text, "values"));
}

} // namespace obscura::emulator
