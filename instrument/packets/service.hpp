// SPDX-License-Identifier: Apache-2.0
// Space packets over UDP: sends telemetry of a daemon's cameras, and does telecommands.
#pragma once

#include "core/io/file_descriptor.hpp"
#include "instrument/link/admission.hpp"
#include "instrument/link/daemon_link.hpp"
#include "instrument/link/recorded_link.hpp"
#include "instrument/packets/frame_reports.hpp"
#include "instrument/packets/telemetry.hpp"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace obscura::instrument {

/// Where packets go and come from. Addresses are IPv4 with a port.
struct PacketOptions {
    std::string telemetry;    ///< receiver of telemetry; empty: none
    std::string telecommands; ///< where telecommands are taken; empty: none
    std::uint16_t first_apid = 256;
};

/// Thread-bound. Telemetry and telecommands have a thread each: a daemon that does not answer one holds up
/// neither the other nor housekeeping.
class PacketService {
public:
    /// Without housekeeping, after which it is sent without the state of the daemon.
    static constexpr std::chrono::seconds max_silence{3};

    /// `admission`: of telecommands; outlives this. Throws Error (exit_usage) for what is no address,
    /// HardwareError if it cannot be used.
    PacketService(const PacketOptions& options, DaemonAddress daemon, const Admission& admission);
    PacketService(const PacketService&) = delete;
    PacketService& operator=(const PacketService&) = delete;

    /// "127.0.0.1:5302", where telecommands are taken; empty: nowhere.
    [[nodiscard]] const std::string& telecommand_address() const noexcept { return telecommand_address_; }
    /// Serves until `stopped`, which is thread-safe and asked ten times a second, returns true.
    void run(const std::function<bool()>& stopped);

private:
    using Steady = std::chrono::steady_clock;

    void serve_telemetry(const std::function<bool()>& stopped);
    void serve_telecommands(const std::function<bool()>& stopped);
    void take_commands();
    void take(std::span<const std::uint8_t> datagram);
    /// Does a command other than a trigger. Throws LinkError.
    void execute(const Telecommand& command);
    void settle_trigger();
    void report(const Telecommand& command, CommandResult result, std::uint64_t frame = 0);
    /// Asks the daemon, sends frame reports and, if it is time, housekeeping.
    void look(bool housekeeping);
    void send_reports(std::uint32_t camera);
    /// Housekeeping of each camera; with an empty list it says that the daemon does not answer.
    void send_housekeeping(std::vector<std::optional<CameraState>> cameras);
    void count_command(std::uint32_t PacketCounters::*counter);
    /// Sends what `source` becomes. With mutex_ locked.
    template<typename Source>
    void send(const Source& source);
    [[nodiscard]] std::int64_t tai_now() const;

    const std::uint16_t first_apid_;
    const Admission& admission_;
    std::string telecommand_address_;
    FileDescriptor sender_, receiver_;
    /// Link of the telemetry. Telecommands have their own, which may connect to another daemon unnoticed.
    DaemonLink link_;
    DaemonLink commanded_;
    RecordedLink commands_;             ///< to commanded_
    std::vector<FrameReports> reports_; ///< by camera
    std::optional<std::string> run_;    ///< of the daemon that was asked last; none: none was
    bool connected_ = false;            ///< to that daemon, as far as is known

    std::mutex mutex_; ///< of what the threads share, up to housekeeping_sent_
    TelemetryWriter writer_;
    PacketCounters counters_;
    std::optional<std::int64_t> tai_offset_ns_;
    std::size_t cameras_ = 1; ///< of the daemon
    Steady::time_point housekeeping_sent_ = Steady::now();

    std::optional<std::uint16_t> next_command_; ///< sequence count
    std::optional<Telecommand> triggering_;
};

} // namespace obscura::instrument
