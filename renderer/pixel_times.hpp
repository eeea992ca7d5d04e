// SPDX-License-Identifier: Apache-2.0
// Times of the pixels of a sensor that scans.
#pragma once

#include "core/camera/frame.hpp"

#include <cstdint>
#include <span>

namespace obscura::models {
class TimingProgram;
}

namespace obscura::renderer {

/// Times of pixels by a timing model, in scene time. Real-time safe.
struct PixelTimes {
    const models::TimingProgram* timing = nullptr; ///< null: pixels have the times of their rows
    Time trigger;
    double rate = 1; ///< seconds of the scene for one second of the model
    /// What is read: its size, the exposure that was asked for, and its first column and row on the sensor.
    std::int32_t rows = 0, columns = 0;
    std::int64_t exposure_ns = 0;
    std::int32_t x = 0, y = 0;

    [[nodiscard]] explicit operator bool() const noexcept { return timing != nullptr; }
    bool operator==(const PixelTimes&) const noexcept = default;
    /// Times of the pixels of a row of the sensor from column `first_x` on; outside what is read those of
    /// the nearest pixel.
    void fill(std::int32_t sensor_y, std::int32_t first_x, std::span<RowTime> times) const noexcept;
    /// From the earliest reset to the latest read of a row of the sensor.
    [[nodiscard]] RowTime span_of(std::int32_t sensor_y) const noexcept;

private:
    [[nodiscard]] RowTime shown(const RowTime& after_trigger) const noexcept;
};

/// Times for a model whose pixels have times of their own, which may be null; else empty.
[[nodiscard]] PixelTimes pixel_times_of(const models::TimingProgram* timing) noexcept;

} // namespace obscura::renderer
