// SPDX-License-Identifier: Apache-2.0
#include "instrument/packets/telecommands.hpp"

#include "core/camera/setting_table.hpp"
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
constexpr std::array source_words{name_of(TriggerSource::software), name_of(TriggerSource::line0),
                                  name_of(TriggerSource::line1), name_of(TriggerSource::line2),
                                  name_of(TriggerSource::line3)};
static_assert(source_words.size() == sources.size());

constexpr std::array<FieldInfo, 2> header_of_telecommands{
    {{"FUNCTION", FieldType::u8, "", "What is to be done"},
     {"CAMERA", FieldType::u8, "", "Number of the camera, from 0", {}, 0, 255}}};

/// A command that sets a camera setting.
struct SettingCommand {
    CommandFunction function;
    std::string_view name, argument; ///< as ground systems have them
    const Setting& setting;
    std::string_view help;
    std::span<const FieldState> states{};
};
constexpr std::array setting_commands{
    SettingCommand{CommandFunction::set_exposure, "SET_EXPOSURE", "EXPOSURE", setting("ExposureTime"),
                   "Sets ExposureTime"},
    SettingCommand{CommandFunction::set_gain, "SET_GAIN", "GAIN", setting("Gain"), "Sets Gain"},
    SettingCommand{CommandFunction::set_black_level, "SET_BLACK_LEVEL", "BLACK_LEVEL", setting("BlackLevel"),
                   "Sets BlackLevel"},
    SettingCommand{CommandFunction::set_frame_rate, "SET_FRAME_RATE", "FRAME_RATE",
                   setting("AcquisitionFrameRate"), "Sets AcquisitionFrameRate"},
    SettingCommand{CommandFunction::set_trigger_source, "SET_TRIGGER_SOURCE", "SOURCE",
                   setting("TriggerSource"), "Sets TriggerSource", sources},
};

PacketInfo packet_of(const SettingCommand& command) {
    FieldInfo field{command.argument, command.states.empty() ? FieldType::f64 : FieldType::u8,
                    command.setting.unit, command.setting.help, command.states};
    const double initial = default_of(command.setting);
    if (const std::optional<SettingRange> range = widest_range(command.setting)) {
        field.least = range->minimum;
        field.most = range->maximum;
        field.initial = initial;
    } else {
        for (std::size_t i = 0; i < command.states.size(); ++i)
            if (command.setting.word_of(initial) == source_words[i]) field.initial = command.states[i].value;
    }
    return {command.name, command.help, static_cast<std::uint8_t>(command.function), {field}};
}

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
    static const std::vector<PacketInfo> packets = [&] {
        std::vector<PacketInfo> all{
            {"NO_OPERATION", "Is answered with a command report", number(F::no_operation), {}},
            {"START", "Starts the acquisition", number(F::start), {}},
            {"STOP", "Stops the acquisition; the frame in progress is finished", number(F::stop), {}},
            {"TRIGGER",
             "Triggers a frame of TriggerSource Software; reported when its last row has left",
             number(F::trigger),
             {}},
        };
        for (const SettingCommand& command : setting_commands)
            all.push_back(packet_of(command));
        return all;
    }();
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
    for (const SettingCommand& row : setting_commands)
        if (static_cast<std::uint8_t>(row.function) == command.function) command.feature = row.setting.name;
    command.result = CommandResult::done;
    return command;
}

} // namespace obscura::instrument
