// SPDX-License-Identifier: Apache-2.0
// Philox counters and keys of the sensor's random number streams.
#pragma once

#include "core/philox.hpp"
#include "sensors/kernels.hpp"

#include <cstdint>

namespace obscura::sensors {

/// Lowest byte of the third counter word. The next byte is the read number, the upper half the layer number:
/// a pixel in two windows of a frame is read twice, with independent noise.
enum class Effect : std::uint32_t {
    shot_and_read = 0, ///< Poisson draw, amplifier and reset noise
    row_noise,
    hit_count,
    hit,
    rts,
    // Fixed patterns, keyed by the serial.
    response,
    dark,
    offset,
    column_offset,
    defects,
    rts_pixels,
    adc,
    hot,
    shot_and_gauss, ///< shot, amplifier and reset noise in one draw
    follower_rts_pixels,
    response_columns,
    response_shape,
    response_fields,
    model, ///< normal() of a model
};

/// Keys that separate the sensor's random numbers from those of other users of the same seed.
constexpr std::uint64_t temporal_key = 0x6465746563746f72; // "detector"
constexpr std::uint64_t pattern_key = 0x7061747465726e00;  // "pattern"

/// Key of the temporal noise of a run. The counter has no bits left for the run word, so that it is spread
/// over the key by the 64-bit finaliser of MurmurHash3 (A. Appleby): a bijection, hence no two runs of a seed
/// share a key, and run 0 is the seed's own.
constexpr std::uint64_t run_key(std::uint64_t seed, std::uint32_t run) noexcept {
    std::uint64_t word = run;
    word = (word ^ word >> 33) * 0xff51afd7ed558ccd;
    word = (word ^ word >> 33) * 0xc4ceb9fe1a85ec53;
    return seed ^ temporal_key ^ word ^ word >> 33;
}

constexpr kernels::Stream stream_of(Effect effect, std::uint64_t seed, std::uint64_t frame,
                                    std::uint32_t pixel, std::uint32_t read = 0, std::uint32_t layer = 0) {
    return {pixel, static_cast<std::uint32_t>(frame),
            static_cast<std::uint32_t>(effect) | (read & 0xFF) << 8 | layer << 16,
            static_cast<std::uint32_t>(frame >> 32) & 0xFFFF, philox_key(seed)};
}

/// The four words of the counter that the kernels use at attempt 0.
constexpr std::array<std::uint32_t, 4> words_of(const kernels::Stream& s, std::uint32_t index = 0) {
    return philox4x32({s.first_pixel + index, s.frame_low, s.effect, s.frame_high << 16}, s.key);
}

} // namespace obscura::sensors
