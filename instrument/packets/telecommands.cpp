// SPDX-License-Identifier: Apache-2.0
#include "instrument/packets/telecommands.hpp"

#include "instrument/packets/space_packet.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace obscura::instrument {
namespace {

constexpr std::array<FieldState, 10> results{{{0, "DONE"},
                                              {1, "MALFORMED"},
                                              {2, "UNKNOWN"},
                                              {3, "OUT_OF_RANGE"},
                                              {4, "CONTROLLED"},
                                              {5, "NOT_NOW"},
                                              {6, "NO_FRAME"},
                                              {7, "FORBIDDEN"},
                                              {8, "DAEMON_LOST"},
                                              {9, "FAILED"}}};

constexpr std::array<FieldState, 5> sources{
    {{0, "SOFTWARE"}, {1, "LINE0"}, {2, "LINE1"}, {3, "LINE2"}, {4, "LINE3"}}};
/// SFNC names of those.
constexpr std::array<std::string_view, sources.size()> source_words{"Software", "Line0", "Line1", "Line2",
                                                                    "Line3"};

constexpr std::array<FieldInfo, 2> header_of_telecommands{
    {{"FUNCTION", FieldType::u8, "", "What is to be done"},
     {"CAMERA", FieldType::u8, "", "Number of the camera, from 0", {}, 0, 255}}};

/// Features of the functions, by number; empty: none.
constexpr std::array<std::string_view, 9> features{
    "", "", "", "", "ExposureTime", "Gain", "BlackLevel", "AcquisitionFrameRate", "TriggerSource"};

} // namespace

std::span<const FieldState> command_results() {
    return results;
}

std::span<const FieldInfo> telecommand_header() {
    return header_of_telecommands;
}

const std::vector<PacketInfo>& telecommand_packets() {
    using F = CommandFunction;
    const auto number = [](F function) { return static_cast<std::uint8_t>(function); };
    static const std::vector<PacketInfo> packets{
        {"NO_OPERATION", "Is answered with a command report", number(F::no_operation), {}},
        {"START", "Starts the acquisition", number(F::start), {}},
        {"STOP", "Stops the acquisition; the frame in progress is finished", number(F::stop), {}},
        {"TRIGGER",
         "Triggers a frame of TriggerSource Software; reported when its last row has left",
         number(F::trigger),
         {}},
        {"SET_EXPOSURE",
         "Sets ExposureTime",
         number(F::set_exposure),
         {{"EXPOSURE", FieldType::f64, "us", "Exposure time", {}, 1, 1e7}}},
        {"SET_GAIN",
         "Sets Gain",
         number(F::set_gain),
         {{"GAIN", FieldType::f64, "dB", "Gain of the amplifier", {}, 0, 48}}},
        {"SET_BLACK_LEVEL",
         "Sets BlackLevel",
         number(F::set_black_level),
         {{"BLACK_LEVEL", FieldType::f64, "DN", "Digital number of a dark pixel", {}, 0, 65535}}},
        {"SET_FRAME_RATE",
         "Sets AcquisitionFrameRate, the rate of the free run",
         number(F::set_frame_rate),
         {{"FRAME_RATE", FieldType::f64, "Hz", "Frame rate", {}, 0, 1e6}}},
        {"SET_TRIGGER_SOURCE",
         "Sets TriggerSource",
         number(F::set_trigger_source),
         {{"SOURCE", FieldType::u8, "", "Source of the trigger", sources}}},
    };
    return packets;
}

std::optional<Telecommand> read_telecommand(std::span<const std::uint8_t> datagram,
                                            std::uint16_t first_apid) {
    const std::optional<PacketHeader> primary = read_header(datagram);
    if (!primary || !primary->command || primary->apid != first_apid + telecommand_apid) return std::nullopt;
    Telecommand command;
    command.sequence = primary->sequence;
    command.result = CommandResult::malformed;
    const std::span<const std::uint8_t> data = datagram.subspan(primary_header_bytes);
    if (!primary->secondary_header || data.size() < header_of_telecommands.size()) return command;
    command.function = data[0];
    command.camera = data[1];
    if (command.function >= telecommand_packets().size()) {
        command.result = CommandResult::unknown;
        return command;
    }
    std::size_t place = header_of_telecommands.size();
    for (const FieldInfo& field : telecommand_packets()[command.function].fields) {
        const std::size_t bytes = bytes_of(field.type);
        if (data.size() < place + bytes) return command;
        command.number = decode(field.type, number_at(data, place, bytes));
        place += bytes;
        if (!field.states.empty()) {
            if (command.number >= static_cast<double>(source_words.size())) return command;
            command.word = source_words[static_cast<std::size_t>(command.number)];
        } else if (!std::isfinite(command.number)) {
            return command;
        }
    }
    if (place != data.size()) return command;
    command.feature = features[command.function];
    command.result = CommandResult::done;
    return command;
}

} // namespace obscura::instrument
