// SPDX-License-Identifier: Apache-2.0
#include "instrument/scpi/commands.hpp"

#include <fmt/format.h>

#include <string>
#include <utility>

namespace obscura::instrument {
namespace {

ScpiCode code_of(const LinkError& error) {
    const std::string& code = error.code;
    if (code == "controlled" || code == "not-now") return ScpiCode::settings_conflict;
    if (code == "forbidden") return ScpiCode::command_protected;
    if (code == "connection-lost") return ScpiCode::hardware_missing;
    if (code == "bad-argument")
        return error.field == "camera" ? ScpiCode::header_suffix_out_of_range : ScpiCode::data_out_of_range;
    return ScpiCode::execution_error;
}

} // namespace

CommandTable::CommandTable() : rows_(status_commands()) {
    for (Command& row : camera_commands())
        rows_.push_back(std::move(row));
    for (const Command& row : rows_)
        patterns_.emplace_back(row.header.starts_with('*') ? row.header.substr(1) : row.header);
}

std::optional<CommandTable::Found> CommandTable::find(std::span<const std::string> header,
                                                      bool common) const {
    for (std::size_t i = 0; i < rows_.size(); ++i)
        if (rows_[i].header.starts_with('*') == common)
            if (const auto suffix = patterns_[i].match(header)) return Found{&rows_[i], *suffix};
    return std::nullopt;
}

void report(Status& status, const LinkError& error) {
    const ScpiCode code = code_of(error);
    const std::string why = error.what();
    status.report(code, code == ScpiCode::header_suffix_out_of_range
                            ? fmt::format("CAMera1 is camera 0 of the daemon: {}", why)
                            : why);
}

bool settle_trigger(ScpiContext& context, double wait_s) {
    if (!context.link.trigger_pending()) return true;
    try {
        std::optional<TriggerResult> result = context.link.trigger_result(wait_s);
        if (!result) return false;
        if (result->outcome == "missed") context.status.report(ScpiCode::trigger_ignored);
        context.last_trigger = std::move(result);
    } catch (const LinkError& error) {
        const bool camera_not_ready = error.code == "busy";
        if (camera_not_ready)
            context.status.report(ScpiCode::trigger_ignored, error.what());
        else
            report(context.status, error);
    }
    if (std::exchange(context.completion_wanted, false)) context.status.set_event(event_operation_complete);
    return true;
}

void wait_for_trigger(ScpiContext& context) {
    constexpr double slice_s = 0.2; // after which the end of the program is noticed
    while (!settle_trigger(context, slice_s))
        if (context.ended()) return;
}

} // namespace obscura::instrument
