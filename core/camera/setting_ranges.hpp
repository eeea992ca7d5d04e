// SPDX-License-Identifier: Apache-2.0
// Ranges of camera settings that are the same for every sensor. Ranges that depend on it: CameraLimits.
#pragma once

#include "core/camera/frame.hpp"
#include "core/time.hpp"

#include <cstdint>
#include <limits>

namespace obscura {

/// Both ends are allowed. A value that is not a number lies in no range.
template<typename T>
struct SettingRange {
    T minimum, maximum;
    [[nodiscard]] constexpr bool contains(T value) const { return value >= minimum && value <= maximum; }
};

inline constexpr SettingRange<double> auto_target_range_percent{1, 99};
inline constexpr SettingRange<double> auto_percentile_range{1, 100};
inline constexpr SettingRange<std::int64_t> trigger_delay_range_ns{0, 10 * ns_per_s};
inline constexpr SettingRange<std::uint32_t> trigger_divider_range{1, 1'000'000};
/// AcquisitionFrameCount and AcquisitionBurstFrameCount.
inline constexpr SettingRange<std::uint32_t> frame_count_range{1, std::numeric_limits<std::uint32_t>::max()};
/// CameraWindow::reads, of any sampling.
inline constexpr SettingRange<std::int32_t> any_reads_range{1, 64};

/// CameraWindow::reads. A destructive read is the only one of its exposure; a difference needs two.
constexpr SettingRange<std::int32_t> reads_range(Sampling sampling) {
    switch (sampling) {
    case Sampling::destructive:
        return {1, 1};
    case Sampling::non_destructive:
        return any_reads_range;
    case Sampling::cds:
    case Sampling::ramp:
        break;
    }
    return {2, any_reads_range.maximum};
}

} // namespace obscura
