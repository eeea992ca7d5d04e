// SPDX-License-Identifier: Apache-2.0
// Settings and configuration sections of [trigger], [trigger.line1] to [trigger.line3], and [ptp].
#pragma once

#include "config/section.hpp"
#include "core/camera/trigger.hpp"
#include "sync/over_trigger.hpp"
#include "sync/registry.hpp"
#include "sync/schedule.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace obscura::sync {

struct ConditionerSettings;
struct PtpMonitorSettings;

/// Name of the source that delivers no triggers.
inline constexpr std::string_view no_source = "none";

/// One input line of the camera: the trigger source connected to it, and the conditioning of its edges. Keys
/// of one kind of source only are in `kinds`, also those of kinds that are not chosen.
struct TriggerLineSettings {
    std::size_t number = 0; ///< of the line; not a key
    std::string source{no_source};
    double rate_hz = 10;
    double phase_ms = 0;
    std::string device; ///< empty: the default node of the source
    double debounce_us = 0;
    std::int32_t divider = 1;
    double delay_us = 0;
    SourceKinds kinds{};

    bool operator==(const TriggerLineSettings&) const = default;

    /// Whether a source is connected to the line.
    [[nodiscard]] bool connected() const { return source != no_source; }
    /// The chosen kind of source; null for "none" and unknown names.
    [[nodiscard]] const SourceKind* kind() const { return kinds.find(source); }
    /// Dotted path of the line's table, for errors at start: "trigger", "trigger.line1".
    [[nodiscard]] std::string table() const;
    /// The device node that the chosen source opens.
    [[nodiscard]] std::string device_node() const;
    /// rate_hz as a fraction. Throws std::invalid_argument when out of range.
    [[nodiscard]] RationalRate rate() const { return rational_rate(rate_hz); }
    [[nodiscard]] std::int64_t phase_ns() const;
    [[nodiscard]] std::int64_t debounce_ns() const;
    [[nodiscard]] std::int64_t delay_ns() const;
};

/// [trigger]: Line0, which begins frames by default, and the further lines of the camera.
struct TriggerSettings {
    TriggerSettings(); ///< a timer at Line0, the further lines not connected

    std::array<TriggerLineSettings, line_count> lines{}; ///< by number
    OverTrigger over_trigger = OverTrigger::count;

    bool operator==(const TriggerSettings&) const = default;
};

/// [ptp]: ptp4l on this machine, whose clock state is shown to clients.
struct PtpSettings {
    bool enabled = false;
    std::string socket = "/var/run/ptp4l"; ///< ptp4l's uds_address
    std::int32_t domain = 0;
    /// A slave is locked while its offset from the master is at most this.
    double lock_us = 10;

    bool operator==(const PtpSettings&) const = default;
};

/// The table of a further line; it is printed while the line is connected.
[[nodiscard]] config::Section section_of(TriggerLineSettings& line);
/// [trigger] with the tables of the further lines.
[[nodiscard]] config::Section section_of(TriggerSettings& trigger);
[[nodiscard]] config::Section section_of(PtpSettings& ptp);

/// Conditioning of the line's edges (sync/conditioner.hpp).
[[nodiscard]] ConditionerSettings conditioner_settings(const TriggerLineSettings& line);
/// Rate of the line's triggers: its nominal rate behind the divider. Throws std::invalid_argument when out of
/// range, which the line's section has checked.
[[nodiscard]] RationalRate nominal_rate(const TriggerLineSettings& line);
/// Edge types that the line's source can report; none while it is not connected.
[[nodiscard]] LineEdges reported_edges(const TriggerLineSettings& line);
/// Edge types of line `number` in [trigger]; Line0 always reports rising edges at least.
[[nodiscard]] LineEdges reported_edges(const TriggerSettings& trigger, std::size_t number);
/// The source connected to the line, not started; null for "none". `clock` must outlive it. Throws
/// ConfigError for settings that the line's section would refuse.
[[nodiscard]] std::unique_ptr<TriggerSource> make_source(const TriggerLineSettings& line, const Clock& clock,
                                                         const ThreadSettings& thread);

/// Settings of the monitor of ptp4l (sync/ptp_monitor.hpp).
[[nodiscard]] PtpMonitorSettings monitor_settings(const PtpSettings& ptp);

} // namespace obscura::sync
