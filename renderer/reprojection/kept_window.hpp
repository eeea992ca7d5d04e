// SPDX-License-Identifier: Apache-2.0
// Window of a frame whose light is kept for reprojection.
#pragma once

#include "core/camera/region.hpp"

#include <cstdint>
#include <optional>

namespace obscura::renderer {

/// What is rendered of a window, the halo that the detector needs included.
struct KeptWindow {
    Region area{};                        ///< sensor pixels; push-broom: its rows are the lines, from 0
    std::optional<std::int32_t> line_y{}; ///< push-broom: row of the sensor that all lines are

    [[nodiscard]] bool operator==(const KeptWindow&) const noexcept = default;
};

} // namespace obscura::renderer
