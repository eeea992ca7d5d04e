// What is fixed in one specimen of a sensor: response, dark current, offsets, defects.
#pragma once

#include "sensors/description.hpp"

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace obscura::sensors {

/// A pixel whose dark current jumps between two levels.
struct TelegraphPixel {
    std::int32_t x = 0;
    float current_e_per_s = 0; ///< between the levels, at the reference temperature
    float time_constant_s = 1;
    std::uint32_t pixel = 0; ///< number on the array
};

/// A pixel whose amplifier jumps between two levels.
struct FollowerPixel {
    std::int32_t x = 0;
    float step_e = 0; ///< between the levels
    float time_constant_s = 1;
    std::uint32_t pixel = 0; ///< number on the array
};

/// A pixel that always gives the same number.
struct StuckPixel {
    std::int32_t x = 0;
    std::uint16_t dn = 0;
};

/// Lists of special pixels, row by row: those of row y are items[first[y]] to items[first[y + 1]].
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

/// Drawn once from `serial`, or measured; never redrawn. Maps are row-major over the array and go on for
/// kernels::padding elements behind it; an empty one is uniform.
struct FixedPattern {
    std::int32_t width = 0, height = 0;
    std::vector<float> response;     ///< relative, mean 1
    std::vector<float> dark_e_per_s; ///< at the reference temperature
    std::vector<float> offset_e;
    PerRow<TelegraphPixel> telegraph;
    PerRow<FollowerPixel> follower;
    PerRow<StuckPixel> stuck;
    std::vector<bool> dead_row, dead_column; ///< empty: none

    /// Draws or reads the pattern. Throws ConfigError (impossible settings) or InputError (maps).
    explicit FixedPattern(const SensorDescription& description);

    [[nodiscard]] const float* row_of(const std::vector<float>& map, std::int32_t y, std::int32_t x) const {
        return map.empty() ? nullptr
                           : map.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                 static_cast<std::size_t>(x);
    }

    /// Writes response.fits, dark_e_per_s.fits and offset_e.fits to `folder`, for a device under test that is
    /// to be given perfect or stale calibration. Throws OutputError.
    void write_fits(const std::filesystem::path& folder, const SensorDescription& description) const;
};

} // namespace obscura::sensors
