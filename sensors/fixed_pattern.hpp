// SPDX-License-Identifier: Apache-2.0
// Fixed-pattern noise of one sensor specimen: response, dark current, offsets, RTS pixels, defects.
#pragma once

#include "sensors/description.hpp"

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace obscura::sensors {

/// A pixel with two-level RTS noise of its dark current.
struct DarkRtsPixel {
    std::int32_t x = 0;
    float current_e_per_s = 0; ///< distance of the levels, at the reference temperature
    float time_constant_s = 1;
    std::uint32_t pixel = 0; ///< number on the array
};

/// A pixel with a constant digital number.
struct StuckPixel {
    std::int32_t x = 0;
    std::uint16_t dn = 0;
};

/// Pixels grouped by row: those of row y are items[first[y]] to items[first[y + 1] - 1].
template<class T>
struct PerRow {
    std::vector<T> items;
    std::vector<std::uint32_t> first;

    [[nodiscard]] std::span<const T> row(std::int32_t y) const {
        if (first.empty()) return {};
        const auto i = static_cast<std::size_t>(y);
        return std::span(items).subspan(first[i], first[i + 1] - first[i]);
    }
};

/// Fixed pattern drawn once from `serial`, or read from measured maps. Maps are row-major over the array and
/// followed by kernels::padding elements; an empty map is uniform.
struct FixedPattern {
    std::int32_t width = 0, height = 0;
    std::vector<float> response;     ///< to uniform light, crosstalk included: relative, mean 1
    std::vector<float> dark_e_per_s; ///< at the reference temperature
    std::vector<float> offset_e;
    PerRow<DarkRtsPixel> dark_rts;
    PerRow<StuckPixel> stuck;
    std::vector<bool> dead_row, dead_column; ///< empty: none

    /// Draws or reads the pattern. Throws ConfigError (invalid settings) or InputError (maps).
    explicit FixedPattern(const SensorDescription& description);

    [[nodiscard]] const float* row_of(const std::vector<float>& map, std::int32_t y, std::int32_t x) const {
        return map.empty() ? nullptr
                           : map.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                 static_cast<std::size_t>(x);
    }

    /// Writes response.fits, dark_e_per_s.fits and offset_e.fits to `folder`: calibration data, perfect or
    /// stale, for the device under test. Throws OutputError.
    void write_fits(const std::filesystem::path& folder, const SensorDescription& description) const;
};

} // namespace obscura::sensors
