// SPDX-License-Identifier: Apache-2.0
// Scene clock: the scene time that each frame shows, from its number or its trigger edge.
#pragma once

#include "core/text/enum_names.hpp"
#include "core/time.hpp"
#include "ephemeris/time/epoch.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

namespace obscura::emulator {

/// The clock that the scene follows.
enum class SceneTime : std::uint8_t {
    nominal, ///< frame k shows the scene at (k - 1) nominal periods: the same bytes on every run
    clock,   ///< at the time that passed since the acquisition started
    tai,     ///< at the TAI of the trigger edge, from the scene's epoch on
    replay,  ///< frame k shows the k-th of recorded scene times
};
constexpr auto enum_names(SceneTime /*type*/) {
    return std::array{EnumName{SceneTime::nominal, "nominal"}, EnumName{SceneTime::clock, "clock"},
                      EnumName{SceneTime::tai, "tai"}, EnumName{SceneTime::replay, "replay"}};
}

/// Linear map from the time in which the readout of a frame is planned to the scene time that is rendered.
/// The identity unless the scene starts later, runs at another rate or is replayed.
struct SceneShown {
    Time planned{}, shown{}; ///< a pair of instants
    double rate = 1;         ///< seconds of the scene for one second of the plan

    [[nodiscard]] Time at(Time plan) const noexcept;
};

struct SceneClockSettings {
    SceneTime mode = SceneTime::nominal;
    std::int64_t start_ns = 0; ///< scene time of the start; `tai`: added to it; not for `replay`
    double rate = 1;           ///< of `nominal` and `clock`, above 0
    /// `replay`: scene times at the edges of frames 1, 2, ...; the last one holds.
    std::vector<Time> times{};
    /// Instant of scene time 0, for `tai`.
    ephemeris::Epoch epoch{};
};

/// The only owner of the mapping from triggers to scene time. Real-time safe; thread-bound to the pipeline
/// while it acquires.
class SceneClock {
public:
    explicit SceneClock(SceneClockSettings settings) : settings_(std::move(settings)) {}

    /// Begins an acquisition, at `now` of the scheduling clock.
    void begin(Time now) noexcept { begin_ = now; }

    /// What is known of a trigger edge.
    struct Edge {
        std::uint64_t frame_id = 1;
        Time nominal{};                 ///< (frame_id - 1) nominal periods
        Time edge{};                    ///< scheduling clock
        std::int64_t tai_offset_ns = 0; ///< TAI minus the scheduling clock
        std::optional<Time> given{};    ///< scene time that a simulator sets for this frame
    };
    struct Instant {
        Time planned; ///< time of the edge in which the readout is planned
        SceneShown shown;
    };
    /// True if the instant of a frame is that of its edge.
    [[nodiscard]] bool follows_edges() const noexcept {
        return settings_.mode == SceneTime::clock || settings_.mode == SceneTime::tai;
    }
    /// Leap seconds do not enter: every time here counts SI seconds.
    [[nodiscard]] Instant at(const Edge& edge) const noexcept;

private:
    SceneClockSettings settings_;
    Time begin_;
};

/// Reads the recorded scene times of SceneTime::replay: a CSV file with the column time_s, one row for each
/// frame. Throws ConfigError `file:line:column: what`.
[[nodiscard]] std::vector<Time> read_scene_times(const std::filesystem::path& file);

} // namespace obscura::emulator
