// SPDX-License-Identifier: Apache-2.0
#include "sensors/rts_noise.hpp"

#include "sensors/streams.hpp"

#include <cmath>

namespace obscura::sensors {

bool rts_is_high(std::uint64_t key, std::uint32_t pixel, double time_constant_s, double time_s) noexcept {
    constexpr double redraw_probability = 0.22119921692859512; // per grid step: 1 - exp(-1/4)
    constexpr int max_steps_back = 400;                        // (1 - redraw_probability)^400 < 1e-43
    // Each pixel has its own grid phase, so that pixels with equal time constants do not switch together.
    const double phase = uniform_double(words_of(stream_of(Effect::rts, key, 0, pixel, 1))[0]);
    const auto step = static_cast<std::int64_t>(std::floor(4 * time_s / time_constant_s + phase));
    for (int back = 0;; ++back) {
        const auto words = words_of(
            stream_of(Effect::rts, key, static_cast<std::uint64_t>(step - back) & 0xFFFFFFFFFFFF, pixel));
        if (uniform_double(words[0]) < redraw_probability || back == max_steps_back)
            return (words[1] & 1) != 0;
    }
}

} // namespace obscura::sensors
