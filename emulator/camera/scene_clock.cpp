// SPDX-License-Identifier: Apache-2.0
#include "emulator/camera/scene_clock.hpp"

#include "config/csv.hpp"
#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::emulator {

Time SceneShown::at(Time plan) const noexcept {
    const std::int64_t since_ns = plan - planned;
    if (rate == 1) return shown + since_ns;
    // A double has steps of 100 ns after 30 years, a long double of 0.1 ns.
    return shown + std::llroundl(static_cast<long double>(since_ns) * static_cast<long double>(rate));
}

SceneClock::Instant SceneClock::at(const Edge& edge) const noexcept {
    if (edge.given) return {*edge.given, {}};
    switch (settings_.mode) {
    case SceneTime::nominal:
        return {edge.nominal, {{}, Time{settings_.start_ns}, settings_.rate}};
    case SceneTime::clock:
        return {Time{edge.edge - begin_}, {{}, Time{settings_.start_ns}, settings_.rate}};
    case SceneTime::tai:
        return {edge.edge + (edge.tai_offset_ns - settings_.epoch.tai_ns), {{}, Time{settings_.start_ns}, 1}};
    case SceneTime::replay:
        break;
    }
    const auto& times = settings_.times;
    if (times.empty()) return {edge.nominal, {}};
    const std::size_t index =
        std::min(static_cast<std::size_t>(std::max<std::uint64_t>(edge.frame_id, 1) - 1), times.size() - 1);
    return {edge.nominal, {edge.nominal, times[index], 1}};
}

std::vector<Time> read_scene_times(const std::filesystem::path& file) {
    std::vector<Time> times;
    // A double counts nanoseconds up to 104 days and 100 ns at the limit.
    constexpr double max_s = 1e9;
    config::read_csv(file, "time_s", [&](const config::CsvRow& row) {
        if (!(std::abs(row.values[0]) <= max_s))
            row.fail(0, "time_s", fmt::format("{} is out of range, allowed -1e9 to 1e9", row.values[0]));
        times.push_back(Time{std::llround(row.values[0] * 1e9)});
    });
    if (times.empty()) throw ConfigError(fmt::format("{}: no rows after the header", file.string()));
    return times;
}

} // namespace obscura::emulator
