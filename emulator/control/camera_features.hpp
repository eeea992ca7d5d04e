// SPDX-License-Identifier: Apache-2.0
// Settings of a camera by their SFNC names, as keys of the key engine.
#pragma once

#include "config/keys.hpp"
#include "core/camera/camera.hpp"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <string_view>

namespace obscura::emulator {

/// Copy of CameraSettings in the units of SFNC: those settings that belong to every camera. A trigger is that
/// of FrameStart, a window the first one.
class CameraFeatures {
public:
    explicit CameraFeatures(const CameraSettings& settings);
    CameraFeatures(const CameraFeatures&) = delete;
    CameraFeatures& operator=(const CameraFeatures&) = delete;

    /// Rows bound to this object, with the ranges of the camera.
    [[nodiscard]] config::Keys keys(const CameraLimits& limits);
    /// The settings that it was made of, with the values that the rows have now.
    [[nodiscard]] CameraSettings settings() const;

private:
    CameraSettings settings_;
    double exposure_us_, trigger_delay_us_;
};

/// SFNC category of a feature.
[[nodiscard]] std::string_view category_of(std::string_view feature);
/// Increment of a feature's value, in its unit; 0: any.
[[nodiscard]] std::int64_t increment_of(std::string_view feature, const CameraLimits& limits);

/// Whether a feature cannot change during an acquisition, as over GigE Vision.
[[nodiscard]] bool is_fixed_while_acquiring(std::string_view feature);

/// Values of the rows by their names.
[[nodiscard]] nlohmann::json values_of(const config::Keys& keys);

} // namespace obscura::emulator
