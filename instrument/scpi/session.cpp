// SPDX-License-Identifier: Apache-2.0
#include "instrument/scpi/session.hpp"

#include "instrument/scpi/errors.hpp"
#include "instrument/scpi/message.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <optional>
#include <utility>

namespace obscura::instrument {
namespace {

bool is_command_error(ScpiCode code) {
    return static_cast<int>(code) > -200 && code != ScpiCode::no_error;
}

std::string response_text(const ProgramUnit& unit) {
    return fmt::format("{}{}{}", unit.common ? "*" : "", fmt::join(unit.header, ":"), unit.query ? "?" : "");
}

} // namespace

ScpiSession::ScpiSession(const CommandTable& table, CameraLink& link, const std::string& version,
                         bool may_change, std::function<bool()> ended)
    : may_change_(may_change), ended_(std::move(ended)), context_{status_, link, table, version, ended_} {}

std::string ScpiSession::execute(const ProgramUnit& unit, bool message_available) {
    std::vector<std::string> header;
    if (!unit.common && !unit.rooted) header = path_;
    header.insert(header.end(), unit.header.begin(), unit.header.end());
    if (!unit.common) path_.assign(header.begin(), header.end() - 1);
    const std::optional<CommandTable::Found> found = context_.table.find(header, unit.common);
    if (!found || (unit.query ? found->command->query : found->command->set) == nullptr)
        throw ScpiError(ScpiCode::undefined_header, response_text(unit));
    const Command& command = *found->command;
    if (found->suffix == 0) throw ScpiError(ScpiCode::header_suffix_out_of_range, response_text(unit));
    const std::size_t count = unit.parameters.size();
    if (count < (unit.query ? command.query_least : command.least))
        throw ScpiError(ScpiCode::missing_parameter, response_text(unit));
    if (count > (unit.query ? command.query_most : command.most))
        throw ScpiError(ScpiCode::parameter_not_allowed, response_text(unit));
    if (!unit.query && command.changes_camera && !may_change_)
        throw ScpiError(ScpiCode::command_protected, "this port is for queries only");
    const ScpiHandler handler = unit.query ? command.query : command.set;
    return handler({context_, unit.parameters, found->suffix - 1, message_available, command});
}

std::string ScpiSession::execute(std::string_view line) {
    std::string response;
    path_.clear();
    MessageParser parser(line);
    bool good = true;
    while (good) {
        try {
            settle_trigger(context_, 0);
            const std::optional<ProgramUnit> unit = parser.next();
            if (!unit) break;
            const std::string answer = execute(*unit, !response.empty());
            if (!unit->query) continue;
            if (!response.empty()) response += ';';
            response += answer;
        } catch (const ScpiError& error) {
            status_.report(error.code, error.what());
            good = !is_command_error(error.code);
        } catch (const LinkError& error) {
            report(status_, error);
        }
    }
    return response;
}

} // namespace obscura::instrument
