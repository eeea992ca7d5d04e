#include "sensors/telegraph.hpp"

#include "sensors/streams.hpp"

#include <cmath>

namespace obscura::sensors {

bool telegraph_up(std::uint64_t key, std::uint32_t pixel, double time_constant_s, double time_s) noexcept {
    constexpr double forgets = 0.22119921692859512; // 1 - exp(-1/4)
    constexpr int longest_look = 400;               // (1 - forgets)^400 < 1e-43
    // Each pixel has a grid phase of its own, so that pixels with one time constant do not switch together.
    const double phase = uniform_double(words_of(stream_of(Effect::telegraph, key, 0, pixel, 1))[0]);
    const auto step = static_cast<std::int64_t>(std::floor(4 * time_s / time_constant_s + phase));
    for (int back = 0;; ++back) {
        const auto words = words_of(stream_of(
            Effect::telegraph, key, static_cast<std::uint64_t>(step - back) & 0xFFFFFFFFFFFF, pixel));
        if (uniform_double(words[0]) < forgets || back == longest_look) return (words[1] & 1) != 0;
    }
}

} // namespace obscura::sensors
