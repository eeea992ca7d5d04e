// SPDX-License-Identifier: Apache-2.0
#include "tools/scene/scene_time.hpp"

#include "ephemeris/time/leap_seconds.hpp"
#include "ephemeris/time/time_text.hpp"
#include "host/command_line.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

namespace obscura::tools {

double scene_time_of(const scene::Scene& scene, const std::string& text, const std::string& option) {
    double seconds = 0;
    const char* const end = text.data() + text.size();
    const auto [at, error] = std::from_chars(text.data(), end, seconds);
    if (error == std::errc{} && at == end) {
        if (!(std::abs(seconds) <= 1e9))
            throw host::UsageError(fmt::format("{} {}: allowed -1e9 to 1e9 s", option, text));
        return seconds;
    }
    if (!scene.epoch)
        throw host::UsageError(
            fmt::format("{} {}: allowed is a number of seconds; the scene has no epoch, which instants need",
                        option, text));
    const ephemeris::Epoch instant = ephemeris::read_time(text, ephemeris::system_leap_seconds());
    return static_cast<double>(instant.tai_ns - scene.epoch->tai_ns) / 1e9;
}

} // namespace obscura::tools
