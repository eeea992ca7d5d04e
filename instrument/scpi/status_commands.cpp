// SPDX-License-Identifier: Apache-2.0
// Common commands of IEEE 488.2, SYSTem and STATus.
#include "instrument/scpi/commands.hpp"
#include "instrument/scpi/errors.hpp"
#include "instrument/scpi/parameters.hpp"
#include "instrument/scpi/text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>

namespace obscura::instrument {
namespace {

constexpr std::uint32_t max_byte_value = 255, max_word = 65535;

std::string text(std::uint32_t number) {
    return fmt::format("{}", number);
}

/// Reads the condition registers from the daemon.
void look(const ScpiCall& call) {
    unsigned operation = 0, questionable = 0;
    if (call.context.link.trigger_pending()) operation |= operation_triggering;
    try {
        for (const CameraState& camera : call.context.link.state().cameras) {
            if (camera.acquiring) operation |= operation_measuring;
            if (camera.acquiring && camera.trigger_ready) operation |= operation_waiting;
            if (!camera.controller.empty()) operation |= operation_controlled;
            if (camera.clock == "holdover") questionable |= questionable_time;
            if (camera.health == "bad") questionable |= questionable_verdict;
        }
    } catch (const LinkError&) {
        questionable |= questionable_lost;
    }
    call.context.status.operation.look(static_cast<std::uint16_t>(operation));
    call.context.status.questionable.look(static_cast<std::uint16_t>(questionable));
}

std::string status_byte(const ScpiCall& call) {
    const Status& status = call.context.status;
    if (status.operation.enable != 0 || status.questionable.enable != 0) look(call);
    return text(status.status_byte(call.message_available));
}

std::string self_test(const ScpiCall& call) {
    try {
        const DaemonState state = call.context.link.state();
        const bool bad = std::any_of(state.cameras.begin(), state.cameras.end(),
                                     [](const CameraState& camera) { return camera.health == "bad"; });
        return bad ? "1" : "0";
    } catch (const LinkError&) {
        return "2";
    }
}

std::string all_errors(const ScpiCall& call) {
    std::string all = call.context.status.take_error();
    while (call.context.status.errors() > 0)
        all += "," + call.context.status.take_error();
    return all;
}

/// The headers as a block of definite length, a line each.
std::string headers(const ScpiCall& call) {
    std::string lines;
    for (const Command& row : call.context.table.rows()) {
        if (!row.header.starts_with('*') && !row.header.starts_with('[')) lines += ':';
        lines += row.header;
        if (row.set == nullptr) lines += "?/qonly/";
        if (row.query == nullptr) lines += "/nquery/";
        lines += '\n';
    }
    const std::string length = fmt::format("{}", lines.size());
    return fmt::format("#{}{}{}", length.size(), length, lines);
}

/// Rows of STATus:OPERation or STATus:QUEStionable.
template<StatusRegister Status::*which>
void add_register(std::vector<Command>& rows, std::string_view event, std::string_view condition,
                  std::string_view enable) {
    rows.push_back({.header = event,
                    .help = "Bits that went from 0 to 1 between looks at the condition; reading clears them",
                    .query = [](const ScpiCall& call) {
                        look(call);
                        return text((call.context.status.*which).take_event());
                    }});
    rows.push_back({.header = condition, .help = "The bits now", .query = [](const ScpiCall& call) {
                        look(call);
                        return text((call.context.status.*which).condition);
                    }});
    rows.push_back({.header = enable,
                    .parameters = "<0 to 65535>",
                    .help = "Bits of the event register that count for the status byte",
                    .set =
                        [](const ScpiCall& call) {
                            (call.context.status.*which).enable =
                                static_cast<std::uint16_t>(integer_of(call.parameters[0], max_word));
                            return std::string();
                        },
                    .query = [](const ScpiCall& call) { return text((call.context.status.*which).enable); },
                    .least = 1,
                    .most = 1});
}

} // namespace

std::vector<Command> status_commands() {
    std::vector<Command> rows{
        {.header = "*IDN",
         .help = "Manufacturer, model, serial number (0) and version",
         .query =
             [](const ScpiCall& call) {
                 return fmt::format("Obscura,obscura-instrument,0,{}", call.context.version);
             }},
        {.header = "*RST",
         .help = "Forgets the result of the last trigger and a pending *OPC; "
                 "settings and acquisition of the camera, which others may be using, stay",
         .set =
             [](const ScpiCall& call) {
                 call.context.last_trigger.reset();
                 call.context.completion_wanted = false;
                 return std::string();
             }},
        {.header = "*TST",
         .help =
             "0: the daemon answers and no camera is bad; 1: a camera is bad; 2: the daemon does not answer",
         .query = self_test},
        {.header = "*CLS",
         .help = "Empties the error queue and the event registers",
         .set =
             [](const ScpiCall& call) {
                 call.context.status.clear();
                 call.context.completion_wanted = false;
                 return std::string();
             }},
        {.header = "*ESE",
         .parameters = "<0 to 255>",
         .help = "Bits of *ESR? that count for the status byte",
         .set =
             [](const ScpiCall& call) {
                 call.context.status.event_enable =
                     static_cast<std::uint8_t>(integer_of(call.parameters[0], max_byte_value));
                 return std::string();
             },
         .query = [](const ScpiCall& call) { return text(call.context.status.event_enable); },
         .least = 1,
         .most = 1},
        {.header = "*ESR",
         .help = "Standard event register; reading clears it",
         .query = [](const ScpiCall& call) { return text(call.context.status.take_event()); }},
        {.header = "*SRE",
         .parameters = "<0 to 255>",
         .help = "Bits of *STB? that set its bit 6",
         .set =
             [](const ScpiCall& call) {
                 constexpr std::uint32_t summary_bit = 1U << 6; // not settable: IEEE 488.2, 11.3.2.3
                 call.context.status.service_enable =
                     static_cast<std::uint8_t>(integer_of(call.parameters[0], max_byte_value) & ~summary_bit);
                 return std::string();
             },
         .query = [](const ScpiCall& call) { return text(call.context.status.service_enable); },
         .least = 1,
         .most = 1},
        {.header = "*STB", .help = "Status byte", .query = status_byte},
        {.header = "*OPC",
         .help =
             "Sets bit 0 of *ESR? when the pending trigger has its outcome; the query waits for it and answers 1",
         .set =
             [](const ScpiCall& call) {
                 if (call.context.link.trigger_pending())
                     call.context.completion_wanted = true;
                 else
                     call.context.status.set_event(event_operation_complete);
                 return std::string();
             },
         .query =
             [](const ScpiCall& call) {
                 wait_for_trigger(call.context);
                 return std::string("1");
             }},
        {.header = "*WAI",
         .help = "Waits for the outcome of the pending trigger",
         .set =
             [](const ScpiCall& call) {
                 wait_for_trigger(call.context);
                 return std::string();
             }},
        {.header = "SYSTem:ERRor[:NEXT]",
         .help = "Number and text of the oldest error; 0,\"No error\" if there is none",
         .query = [](const ScpiCall& call) { return call.context.status.take_error(); }},
        {.header = "SYSTem:ERRor:ALL", .help = "All errors, oldest first", .query = all_errors},
        {.header = "SYSTem:ERRor:COUNt",
         .help = "Number of errors in the queue, which has room for 32",
         .query =
             [](const ScpiCall& call) {
                 return text(static_cast<std::uint32_t>(call.context.status.errors()));
             }},
        {.header = "SYSTem:VERSion",
         .help = "Version of SCPI",
         .query = [](const ScpiCall&) { return std::string("1999.0"); }},
        {.header = "SYSTem:HELP:HEADers",
         .help = "All headers, a line each, as a block of definite length",
         .query = headers},
        {.header = "SYSTem:CAMera:COUNt",
         .help = "Number of cameras of the daemon",
         .query =
             [](const ScpiCall& call) {
                 return text(static_cast<std::uint32_t>(call.context.link.state().cameras.size()));
             }},
        {.header = "STATus:PRESet",
         .help = "Clears the enable registers of OPERation and QUEStionable",
         .set =
             [](const ScpiCall& call) {
                 call.context.status.preset();
                 return std::string();
             }},
    };
    add_register<&Status::operation>(rows, "STATus:OPERation[:EVENt]", "STATus:OPERation:CONDition",
                                     "STATus:OPERation:ENABle");
    add_register<&Status::questionable>(rows, "STATus:QUEStionable[:EVENt]", "STATus:QUEStionable:CONDition",
                                        "STATus:QUEStionable:ENABle");
    return rows;
}

} // namespace obscura::instrument
