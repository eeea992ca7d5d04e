// SPDX-License-Identifier: Apache-2.0
#include "core/camera/setting_table.hpp"

#include <map>
#include <string>

namespace obscura {
namespace {

using Helps = std::map<std::string_view, std::string, std::less<>>;

Helps helps_with_lock() {
    Helps all;
    for (const std::span<const Setting> table :
         {std::span<const Setting>(camera_settings_table), std::span<const Setting>(window_settings_table)})
        for (const Setting& row : table)
            if (row.lock == SettingLock::streaming)
                all.emplace(row.name, std::string(row.help) + "; not during acquisition");
    return all;
}

} // namespace

CameraLimits widest_limits() {
    CameraLimits limits;
    limits.sensor_width = limits.sensor_height = max_sensor_extent;
    limits.black_level_max_dn = max_black_level_dn(max_adc_bits);
    return limits;
}

std::optional<SettingRange> widest_range(const Setting& setting) {
    return setting.range_of(widest_limits());
}

double default_of(const Setting& setting) {
    return setting.member.get(CameraSettings{});
}

std::string_view help_with_lock(const Setting& setting) {
    static const Helps helps = helps_with_lock();
    const auto found = helps.find(setting.name);
    return found == helps.end() ? setting.help : std::string_view(found->second);
}

} // namespace obscura
