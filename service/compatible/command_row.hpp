// SPDX-License-Identifier: Apache-2.0
// Builder of a row of the published client's table of commands.
#pragma once

#include "service/compatible/commands.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

namespace obscura::service::compatible {

/// A row in the making: row("setPSFSigma").takes("sigma:number").in(Group::preview).
class Row {
public:
    explicit Row(std::string_view name) { command_.name = name; }

    /// "name:type" of each argument, with "?" behind those that may be left out.
    [[nodiscard]] Row takes(std::string_view arguments) && {
        while (!arguments.empty()) {
            std::string_view one = arguments.substr(0, arguments.find(' '));
            arguments.remove_prefix(std::min(one.size() + 1, arguments.size()));
            Argument argument;
            argument.optional = one.ends_with('?');
            if (argument.optional) one.remove_suffix(1);
            argument.name = one.substr(0, one.find(':'));
            argument.type = enum_named<ArgumentType>(one.substr(one.find(':') + 1)).value();
            command_.arguments.push_back(argument);
        }
        return std::move(*this);
    }
    /// Fields of the answer, for which the client waits.
    [[nodiscard]] Row gives(std::string_view fields) && {
        while (!fields.empty()) {
            command_.results.push_back(fields.substr(0, fields.find(' ')));
            fields.remove_prefix(std::min(command_.results.back().size() + 1, fields.size()));
        }
        return std::move(*this).awaited();
    }
    [[nodiscard]] Row awaited() && { return (command_.awaited = Awaited::yes, std::move(*this)); }
    [[nodiscard]] Row unanswered() && { return (command_.awaited = Awaited::never, std::move(*this)); }
    [[nodiscard]] Row help(std::string_view text) && { return (command_.help = text, std::move(*this)); }

    [[nodiscard]] Command in(Group group) && {
        command_.group = group;
        if (group == Group::preview)
            command_.help = "Of another rendering mode: remembered, the picture is the same.";
        return std::move(command_);
    }

private:
    Command command_;
};

} // namespace obscura::service::compatible
