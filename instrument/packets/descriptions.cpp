// SPDX-License-Identifier: Apache-2.0
#include "instrument/packets/descriptions.hpp"

#include "core/text/text.hpp"
#include "instrument/packets/space_packet.hpp"
#include "instrument/packets/telecommands.hpp"
#include "instrument/packets/telemetry.hpp"

#include <fmt/format.h>

#include <array>
#include <span>
#include <string_view>

namespace obscura::instrument {
namespace {

/// A field of the primary header; its value, if it is the same in all packets of a kind.
struct HeaderBits {
    std::string_view name;
    unsigned bits;
    std::string_view help;
};
constexpr std::array<HeaderBits, 7> primary{{{"CCSDS_VERSION", 3, "Packet version number"},
                                             {"CCSDS_TYPE", 1, "0: telemetry, 1: telecommand"},
                                             {"CCSDS_SECONDARY", 1, "Whether there is a secondary header"},
                                             {"CCSDS_APID", 11, "Application process identifier"},
                                             {"CCSDS_FLAGS", 2, "3: not segmented"},
                                             {"CCSDS_SEQUENCE", 14, "Sequence count"},
                                             {"CCSDS_LENGTH", 16, "Bytes behind this header, less one"}}};

unsigned bits_of(FieldType type) {
    return static_cast<unsigned>(8 * bytes_of(type));
}

/// XTCE of the type of a field: a parameter's or an argument's (`what`).
std::string xtce_type(const FieldInfo& field, std::string_view name, std::string_view what) {
    const unsigned bits = bits_of(field.type);
    const std::string unit =
        field.unit.empty() ? "<UnitSet/>" : fmt::format("<UnitSet><Unit>{}</Unit></UnitSet>", field.unit);
    const std::string range =
        field.most > field.least && what == "Argument"
            ? fmt::format(
                  "<ValidRangeSet><ValidRange minInclusive=\"{}\" maxInclusive=\"{}\"/></ValidRangeSet>",
                  field.least, field.most)
            : std::string();
    if (is_float(field.type))
        return fmt::format(
            "      <Float{0}Type name=\"{1}\" sizeInBits=\"{2}\">{3}<FloatDataEncoding sizeInBits=\"{2}\"/>{4}</Float{0}Type>\n",
            what, name, bits, unit, range);
    const bool is_signed = field.type == FieldType::i64;
    const std::string encoding = fmt::format("<IntegerDataEncoding sizeInBits=\"{}\" encoding=\"{}\"/>", bits,
                                             is_signed ? "twosComplement" : "unsigned");
    if (field.states.empty())
        return fmt::format(
            "      <Integer{0}Type name=\"{1}\" sizeInBits=\"{2}\" signed=\"{3}\">{4}{5}{6}</Integer{0}Type>\n",
            what, name, bits, is_signed, unit, encoding, range);
    std::string states;
    for (const FieldState& state : field.states)
        states += fmt::format("<Enumeration value=\"{}\" label=\"{}\"/>", state.value, state.name);
    return fmt::format(
        "      <Enumerated{0}Type name=\"{1}\">{2}{3}<EnumerationList>{4}</EnumerationList></Enumerated{0}Type>\n",
        what, name, unit, encoding, states);
}

/// Parameter of a field of telemetry: "FRAME_OUTCOME".
std::string parameter_name(std::string_view packet, const FieldInfo& field) {
    return fmt::format("{}_{}", packet, field.name);
}

std::string parameter(std::string_view name, std::string_view help) {
    return fmt::format("      <Parameter name=\"{0}\" parameterTypeRef=\"{0}\" shortDescription=\"{1}\"/>\n",
                       name, escaped_xml(help));
}

std::string base(std::string_view container, std::string_view conditions) {
    return fmt::format("        <BaseContainer containerRef=\"{}\">\n"
                       "          <RestrictionCriteria>\n"
                       "            <ComparisonList>\n"
                       "{}            </ComparisonList>\n"
                       "          </RestrictionCriteria>\n"
                       "        </BaseContainer>\n",
                       container, conditions);
}

std::string condition(std::string_view name, unsigned value) {
    return fmt::format(
        "              <Comparison parameterRef=\"{}\" value=\"{}\" useCalibratedValue=\"false\"/>\n", name,
        value);
}

std::string xtce_telemetry(std::uint16_t first_apid) {
    std::string types, parameters, containers, entries;
    const auto entry = [&entries](std::string_view name) {
        entries += fmt::format("          <ParameterRefEntry parameterRef=\"{}\"/>\n", name);
    };
    const auto container = [&](std::string_view name, std::string_view help, bool abstract,
                               const std::string& basis) {
        containers +=
            fmt::format("      <SequenceContainer name=\"{}\" shortDescription=\"{}\"{}>\n"
                        "        <EntryList>\n"
                        "{}        </EntryList>\n"
                        "{}      </SequenceContainer>\n",
                        name, escaped_xml(help), abstract ? " abstract=\"true\"" : "", entries, basis);
        entries.clear();
    };
    for (const HeaderBits& field : primary) {
        types += fmt::format(
            "      <IntegerParameterType name=\"{0}\" sizeInBits=\"{1}\" signed=\"false\"><UnitSet/><IntegerDataEncoding sizeInBits=\"{1}\" encoding=\"unsigned\"/></IntegerParameterType>\n",
            field.name, field.bits);
        parameters += parameter(field.name, field.help);
        entry(field.name);
    }
    container("CCSDS_PACKET", "Primary header of CCSDS 133.0-B", true, {});
    const auto add = [&](std::string_view name, const FieldInfo& field) {
        types += xtce_type(field, name, "Parameter");
        parameters += parameter(name, field.help);
        entry(name);
    };
    for (const FieldInfo& field : telemetry_header())
        add(field.name, field);
    container("TELEMETRY", "Secondary header: time code of CCSDS 301.0-B", true,
              base("CCSDS_PACKET", condition("CCSDS_VERSION", 0) + condition("CCSDS_TYPE", 0)));
    for (const PacketInfo& packet : telemetry_packets()) {
        for (const FieldInfo& field : packet.fields)
            add(parameter_name(packet.name, field), field);
        container(packet.name, packet.help, false,
                  base("TELEMETRY", condition("CCSDS_APID", first_apid + packet.number)));
    }
    return fmt::format("  <TelemetryMetaData>\n"
                       "    <ParameterTypeSet>\n"
                       "{}    </ParameterTypeSet>\n"
                       "    <ParameterSet>\n"
                       "{}    </ParameterSet>\n"
                       "    <ContainerSet>\n"
                       "{}    </ContainerSet>\n"
                       "  </TelemetryMetaData>\n",
                       types, parameters, containers);
}

std::size_t command_bytes(const PacketInfo& packet) {
    std::size_t bytes = 0;
    for (const FieldInfo& field : telecommand_header())
        bytes += bytes_of(field.type);
    for (const FieldInfo& field : packet.fields)
        bytes += bytes_of(field.type);
    return bytes;
}

std::string xtce_commands(std::uint16_t first_apid) {
    const FieldInfo& camera = telecommand_header()[1];
    std::string types = xtce_type(camera, camera.name, "Argument"), commands;
    for (const PacketInfo& packet : telecommand_packets()) {
        // A ground system counts the sequence; what stands here has count 0.
        const auto header =
            make_packet({true, true, static_cast<std::uint16_t>(first_apid + telecommand_apid), 0},
                        std::vector<std::uint8_t>(command_bytes(packet)));
        std::string arguments = fmt::format(
            "          <Argument name=\"{0}\" argumentTypeRef=\"{0}\" shortDescription=\"{1}\" initialValue=\"0\"/>\n",
            camera.name, escaped_xml(camera.help));
        std::string entries;
        const auto fixed = [&](std::string_view name, unsigned bits, std::uint64_t value) {
            entries += fmt::format(
                "            <FixedValueEntry name=\"{}\" binaryValue=\"{:0{}X}\" sizeInBits=\"{}\"/>\n",
                name, value, bits / 4, bits);
        };
        const auto argument = [&entries](std::string_view name) {
            entries += fmt::format("            <ArgumentRefEntry argumentRef=\"{}\"/>\n", name);
        };
        fixed("CCSDS_IDENTIFICATION", 16, number_at(header, 0, 2));
        fixed("CCSDS_CONTROL", 16, number_at(header, 2, 2));
        fixed("CCSDS_LENGTH", 16, number_at(header, 4, 2));
        fixed("FUNCTION", 8, packet.number);
        argument(camera.name);
        for (const FieldInfo& field : packet.fields) {
            types += xtce_type(field, field.name, "Argument");
            arguments += fmt::format(
                "          <Argument name=\"{0}\" argumentTypeRef=\"{0}\" shortDescription=\"{1}\"/>\n",
                field.name, escaped_xml(field.help));
            argument(field.name);
        }
        commands += fmt::format("      <MetaCommand name=\"{0}\" shortDescription=\"{1}\">\n"
                                "        <ArgumentList>\n"
                                "{2}        </ArgumentList>\n"
                                "        <CommandContainer name=\"{0}\">\n"
                                "          <EntryList>\n"
                                "{3}          </EntryList>\n"
                                "        </CommandContainer>\n"
                                "      </MetaCommand>\n",
                                packet.name, escaped_xml(packet.help), arguments, entries);
    }
    return fmt::format("  <CommandMetaData>\n"
                       "    <ArgumentTypeSet>\n"
                       "{}    </ArgumentTypeSet>\n"
                       "    <MetaCommandSet>\n"
                       "{}    </MetaCommandSet>\n"
                       "  </CommandMetaData>\n",
                       types, commands);
}

constexpr std::string_view cosmos_head = "# Made by: obscura-instrument --describe {}; do not edit.\n";

std::string_view cosmos_type(FieldType type) {
    if (is_float(type)) return "FLOAT";
    return type == FieldType::i64 ? "INT" : "UINT";
}

/// What stands below a field: its states and its unit.
std::string cosmos_details(const FieldInfo& field) {
    std::string lines;
    for (const FieldState& state : field.states)
        lines += fmt::format("    STATE {} {}\n", state.name, state.value);
    if (!field.unit.empty()) lines += fmt::format("    UNITS {0} {0}\n", field.unit);
    return lines;
}

std::string cosmos_item(const FieldInfo& field) {
    return fmt::format("  APPEND_ITEM {} {} {} \"{}\"\n{}", field.name, bits_of(field.type),
                       cosmos_type(field.type), field.help, cosmos_details(field));
}

std::string cosmos_parameter(const FieldInfo& field) {
    const double most = field.states.empty() ? field.most : static_cast<double>(field.states.size() - 1);
    return fmt::format("  APPEND_PARAMETER {} {} {} {} {} {} \"{}\"\n{}", field.name, bits_of(field.type),
                       cosmos_type(field.type), field.least, most, field.initial, field.help,
                       cosmos_details(field));
}

} // namespace

std::string xtce_description(std::uint16_t first_apid) {
    return fmt::format(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
        "<!-- Made by obscura-instrument for APIDs from {} on -->\n"
        "<SpaceSystem xmlns=\"http://www.omg.org/spec/XTCE/20180204\" name=\"OBSCURA\" shortDescription=\"Stand-in for a space camera\">\n"
        "{}{}</SpaceSystem>\n",
        first_apid, xtce_telemetry(first_apid), xtce_commands(first_apid));
}

std::string cosmos_telemetry(std::uint16_t first_apid) {
    std::string file = fmt::format(cosmos_head, "cosmos-telemetry");
    for (const PacketInfo& packet : telemetry_packets()) {
        file +=
            fmt::format("\nTELEMETRY <%= target_name %> {} BIG_ENDIAN \"{}\"\n", packet.name, packet.help);
        for (const HeaderBits& field : primary)
            file +=
                field.name == "CCSDS_APID"
                    ? fmt::format("  APPEND_ID_ITEM {} {} UINT {} \"{}\"\n", field.name, field.bits,
                                  first_apid + packet.number, field.help)
                    : fmt::format("  APPEND_ITEM {} {} UINT \"{}\"\n", field.name, field.bits, field.help);
        for (const FieldInfo& field : telemetry_header())
            file += cosmos_item(field);
        for (const FieldInfo& field : packet.fields)
            file += cosmos_item(field);
    }
    return file;
}

std::string cosmos_commands(std::uint16_t first_apid) {
    std::string file = fmt::format(cosmos_head, "cosmos-commands");
    for (const PacketInfo& packet : telecommand_packets()) {
        file += fmt::format("\nCOMMAND <%= target_name %> {} BIG_ENDIAN \"{}\"\n", packet.name, packet.help);
        const std::array<std::size_t, primary.size()> values{
            0,
            1,
            1,
            static_cast<std::size_t>(first_apid + telecommand_apid),
            3,
            0,
            command_bytes(packet) - 1};
        for (std::size_t i = 0; i < primary.size(); ++i) {
            const bool counts = primary[i].name == "CCSDS_SEQUENCE";
            file += fmt::format("  {} {} {} UINT {} {} {} \"{}\"\n",
                                primary[i].name == "CCSDS_APID" ? "APPEND_ID_PARAMETER" : "APPEND_PARAMETER",
                                primary[i].name, primary[i].bits, values[i],
                                counts ? sequence_modulus - 1 : values[i], values[i], primary[i].help);
        }
        const FieldInfo& function = telecommand_header()[0];
        file += fmt::format("  APPEND_ID_PARAMETER {0} 8 UINT {1} {1} {1} \"{2}\"\n", function.name,
                            packet.number, function.help);
        file += cosmos_parameter(telecommand_header()[1]);
        for (const FieldInfo& field : packet.fields)
            file += cosmos_parameter(field);
    }
    return file;
}

} // namespace obscura::instrument
