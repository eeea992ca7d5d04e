// SPDX-License-Identifier: Apache-2.0
// Telemetry packets: housekeeping, a report of each frame, a report of each command.
#pragma once

#include "core/camera/frame_record.hpp"
#include "instrument/link/camera_link.hpp"
#include "instrument/packets/fields.hpp"
#include "instrument/packets/telecommands.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace obscura::instrument {

/// What this program has done since it started.
struct PacketCounters {
    std::uint32_t reports = 0;      ///< frame reports that were sent
    std::uint32_t reports_lost = 0; ///< frames without one
    std::uint32_t commands_done = 0, commands_refused = 0;
    std::uint32_t command_gaps = 0; ///< sequence counts of commands that did not follow
};

/// Source of a housekeeping packet.
struct Housekeeping {
    std::uint32_t camera = 0;
    std::optional<CameraState> state; ///< none: the daemon does not answer
    PacketCounters own;
};

/// Source of a frame report.
struct FrameReport {
    std::uint32_t camera = 0;
    FrameRecord frame;                        ///< as far as the daemon told it
    std::int64_t tai_offset_ns = 0;           ///< TAI since 1970 minus the clock of its instants
    std::uint64_t lost_before = 0;            ///< frames since the report before that have none
    std::optional<std::uint32_t> saturated{}; ///< pixels at the largest digital number; none: not counted

    /// Edge of its trigger; 0: there was none.
    [[nodiscard]] std::int64_t edge_tai_ns() const {
        return frame.edge != 0 ? frame.edge + tai_offset_ns : 0;
    }
};

/// Source of a command report.
struct CommandReport {
    std::uint16_t sequence = 0;
    std::uint8_t function = 0, camera = 0;
    CommandResult result = CommandResult::done;
    std::uint64_t frame = 0; ///< of a trigger; 0: none
};

/// Kinds of telemetry by the number that is added to the APID.
enum class TelemetryKind : std::uint8_t { housekeeping, frame, command };
constexpr std::size_t telemetry_kinds = 3;

/// Descriptions of all kinds, in their order, and of the secondary header that they share.
[[nodiscard]] const std::vector<PacketInfo>& telemetry_packets();
[[nodiscard]] std::span<const FieldInfo> telemetry_header();

/// Makes packets with their sequence counts. Thread-bound.
class TelemetryWriter {
public:
    explicit TelemetryWriter(std::uint16_t first_apid) : first_apid_(first_apid) {}

    /// `tai_ns`: when it is made, for the secondary header.
    [[nodiscard]] std::vector<std::uint8_t> write(const Housekeeping& source, std::int64_t tai_ns);
    [[nodiscard]] std::vector<std::uint8_t> write(const FrameReport& source, std::int64_t tai_ns);
    [[nodiscard]] std::vector<std::uint8_t> write(const CommandReport& source, std::int64_t tai_ns);

private:
    std::uint16_t first_apid_;
    std::array<std::uint16_t, telemetry_kinds> sequence_{};
};

} // namespace obscura::instrument
