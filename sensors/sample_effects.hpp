// SPDX-License-Identifier: Apache-2.0
// Effects of the pixel and column amplifiers on the samples of a row, between full well and the ADC.
#pragma once

#include "sensors/description.hpp"
#include "sensors/fixed_pattern.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace obscura::sensors {

/// One sample of the pixels of a window's row.
struct RowSample {
    std::int32_t array_row = 0;
    std::int32_t first_column = 0; ///< on the array
    std::size_t columns = 0;
    std::uint64_t seed = 0; ///< of the run's temporal noise: run_key()
    double time_s = 0;      ///< advances by the frame period per frame
    float weight = 1;       ///< in the converted value; -1: subtracted
    /// Charge in the sample after full well and non-linearity; null: reset level, no charge.
    const float* signal_e = nullptr;
};

/// One effect of one sensor specimen. Its fixed pattern is drawn from the serial at construction.
class SampleEffect {
public:
    virtual ~SampleEffect() = default;

    /// Adds `weight` times the error of the sample, in e-, to `sum_e`. `sum_e` may be `sample.signal_e`.
    /// Thread-safe, real-time safe.
    virtual void add(const RowSample& sample, float* sum_e) const noexcept = 0;
};
using SampleEffects = std::vector<std::unique_ptr<const SampleEffect>>;

/// Effects that are on in `description`, in the order of the signal chain.
[[nodiscard]] SampleEffects make_sample_effects(const SensorDescription& description);

/// A pixel with two-level RTS noise of its source follower.
struct FollowerRtsPixel {
    std::int32_t x = 0;
    float step_e = 0; ///< distance of the levels
    float time_constant_s = 1;
    std::uint32_t pixel = 0; ///< number on the array
};
[[nodiscard]] PerRow<FollowerRtsPixel> follower_rts_pixels(const SensorDescription& description);

} // namespace obscura::sensors
