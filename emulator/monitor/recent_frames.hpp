// SPDX-License-Identifier: Apache-2.0
// Frame counters of the last minute, from snapshots taken every second.
#pragma once

#include "core/text/enum_names.hpp"
#include "core/time.hpp"
#include "emulator/camera/camera.hpp"

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>

namespace obscura::emulator {

/// What happened to triggers and frames within a span of time; names as in CameraCounters.
struct FrameOutcomes {
    double seconds = 0; ///< length of the span
    std::uint64_t triggers = 0, missed_triggers = 0, frames = 0, complete = 0, late = 0, late_rows = 0,
                  stalled = 0, stalled_rows = 0, abandoned = 0, dropped = 0, unsent = 0, degraded = 0;
    MissedCounts missed_because{};
    std::uint64_t undelivered = 0; ///< by transports that deliver every frame
    std::string undelivered_by{};  ///< their kinds, for the line
};

/// Thread-bound.
class RecentFrames {
public:
    static constexpr std::int64_t span_ns = 60 * ns_per_s;

    /// A complete frame is overdue after three times the longest gap between those of the last minute, and
    /// after two seconds at least.
    static constexpr std::int64_t overdue_gaps = 3, min_overdue_ns = 2 * ns_per_s;

    /// Takes a snapshot if the last one is a second old; to be called several times a second.
    /// `undelivered`: see FrameOutcomes, since the start.
    void note(Time now, const CameraCounters& counters, bool acquiring, std::uint64_t undelivered = 0);
    /// Outcomes from about a minute before `now`, or from the first snapshot, until `now`.
    [[nodiscard]] FrameOutcomes until(Time now, const CameraCounters& counters,
                                      std::uint64_t undelivered = 0) const;
    /// Since the last complete frame of this acquisition, and when the next one is overdue. None: there were
    /// not two.
    struct LastFrame {
        double age_s = 0, overdue_s = 0;
    };
    [[nodiscard]] std::optional<LastFrame> last_frame(Time now) const;

private:
    struct Snapshot {
        Time time;
        CameraCounters counters;
        std::uint64_t undelivered = 0;
        std::int64_t max_gap_ns = 0; ///< of frames that came after it, before the next one
    };
    void note_frame(Time now);

    std::deque<Snapshot> snapshots_; ///< oldest first, the first about span_ns before the last
    std::uint64_t complete_ = 0;
    std::optional<Time> frame_;   ///< look that saw the last complete frame of this acquisition
    std::int64_t max_gap_ns_ = 0; ///< 0: not known
};

/// Whether a camera does what it should.
enum class Health : std::uint8_t {
    good, ///< frames come, and in time
    idle, ///< the acquisition is stopped, or no frame was requested
    bad,
};
constexpr auto enum_names(Health /*type*/) {
    return std::array{EnumName{Health::good, "good"}, EnumName{Health::idle, "idle"},
                      EnumName{Health::bad, "bad"}};
}

/// With one line for people: "on time: 0 late rows in 600 frames, last 60 s", or the first reason why not.
struct Verdict {
    Health health = Health::idle;
    std::string text;
};
/// What a camera that acquires begins a frame by.
struct AwaitedTrigger {
    std::string name;        ///< "Line0 (timer)", "Software", "free run"
    bool on_request = false; ///< by a command, so that none for a long time is no fault
    double acquires_s = 0;   ///< time since the start of the acquisition
};
/// `controller`: address of the client in control; empty: none. `for_client`: a client of GigE Vision may
/// come, so that frames which go nowhere until it does are no fault, but said.
[[nodiscard]] Verdict judge(const FrameOutcomes& recent, bool acquiring, const std::string& controller,
                            const AwaitedTrigger& awaited, bool for_client,
                            const std::optional<RecentFrames::LastFrame>& last_frame = {});

} // namespace obscura::emulator
