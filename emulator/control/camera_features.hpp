// SPDX-License-Identifier: Apache-2.0
// Settings of a camera by their SFNC names, as keys of the key engine.
#pragma once

#include "config/keys.hpp"
#include "core/camera/camera.hpp"
#include "core/camera/setting_table.hpp"

#include <nlohmann/json.hpp>

#include <array>
#include <cstdint>

namespace obscura::emulator {

/// Copy of the CameraSettings of camera_settings_table, in the units of SFNC.
class CameraFeatures {
public:
    explicit CameraFeatures(const CameraSettings& settings);
    CameraFeatures(const CameraFeatures&) = delete;
    CameraFeatures& operator=(const CameraFeatures&) = delete;

    /// Keys bound to this object in the order of the table, with the ranges of the camera.
    [[nodiscard]] config::Keys keys(const CameraLimits& limits);
    /// The settings that it was made of, with the values that the keys have now.
    [[nodiscard]] CameraSettings settings() const;

private:
    /// The member that SettingType chooses.
    struct Value {
        std::int64_t integer = 0; ///< of an enumeration: the value
        double floating = 0;
        bool boolean = false;
    };

    CameraSettings settings_;
    std::array<Value, camera_settings_table.size()> values_{};
};

/// Values of the keys by their names.
[[nodiscard]] nlohmann::json values_of(const config::Keys& keys);

} // namespace obscura::emulator
