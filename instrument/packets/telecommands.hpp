// SPDX-License-Identifier: Apache-2.0
// Telecommand packets: their table, and the decoder.
#pragma once

#include "instrument/packets/fields.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace obscura::instrument {

/// What became of a telecommand; its value stands in the command report.
enum class CommandResult : std::uint8_t {
    done,
    malformed,    ///< length or an argument is wrong
    unknown,      ///< no such function
    out_of_range, ///< the camera has no such value, or there is no such camera
    controlled,   ///< a GigE Vision client controls the camera
    not_now,      ///< the camera's state does not allow it
    no_frame,     ///< the trigger made none
    forbidden,    ///< this program may not
    daemon_lost,  ///< the daemon does not answer
    failed,       ///< another reason, which the daemon's log or the log of this program has
};
[[nodiscard]] std::span<const FieldState> command_results();

/// Functions of telecommands: start and so on.
enum class CommandFunction : std::uint8_t {
    no_operation,
    start,
    stop,
    trigger,
    set_exposure,
    set_gain,
    set_black_level,
    set_frame_rate,
    set_trigger_source,
};

/// A telecommand. Commands that set a feature have one argument.
struct Telecommand {
    std::uint16_t sequence = 0;
    std::uint8_t function = 0, camera = 0;
    CommandResult result = CommandResult::done; ///< else it is not to be done
    double number = 0;                          ///< the argument, unless it has states
    std::string_view word{};                    ///< the argument's value of the feature, if it has states
    std::string_view feature{};                 ///< SFNC name; empty: the command sets none
};

/// APID of telecommands: the first one of this program and this number.
constexpr std::uint8_t telecommand_apid = 3;

/// Descriptions of all functions by number, and of the secondary header that they share.
[[nodiscard]] const std::vector<PacketInfo>& telecommand_packets();
[[nodiscard]] std::span<const FieldInfo> telecommand_header();

/// The command of a datagram, which may be one that is not to be done; nullopt: it is no telecommand packet
/// with this APID, and nothing can be said of it.
[[nodiscard]] std::optional<Telecommand> read_telecommand(std::span<const std::uint8_t> datagram,
                                                          std::uint16_t first_apid);

} // namespace obscura::instrument
