// SPDX-License-Identifier: Apache-2.0
#include "service/compatible/commands.hpp"

#include "core/text/printable.hpp"
#include "core/text/suggestion.hpp"
#include "service/compatible/command_rows.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace obscura::service::compatible {
const std::vector<Command>& commands() {
    static const std::vector<Command> all = make_commands();
    return all;
}

const Command* find_command(std::string_view name) noexcept {
    const std::vector<Command>& all = commands();
    const auto found = std::lower_bound(all.begin(), all.end(), name,
                                        [](const Command& row, std::string_view n) { return row.name < n; });
    return found != all.end() && found->name == name ? &*found : nullptr;
}

std::string explain_unknown_command(std::string_view name) {
    std::vector<std::string_view> known;
    for (const Command& command : commands())
        known.push_back(command.name);
    return fmt::format("no call '{}'{}", printable(name, 60), did_you_mean(name, known));
}

std::string signature(const Command& command) {
    std::string text = fmt::format("{}(", command.name);
    for (const Argument& argument : command.arguments)
        text += fmt::format("{}{}: {}{}", text.ends_with('(') ? "" : ", ", argument.name,
                            name_of(argument.type), argument.optional ? " (may be left out)" : "");
    text += ')';
    if (!command.results.empty()) text += fmt::format(" -> {}", fmt::join(command.results, ", "));
    return text;
}

} // namespace obscura::service::compatible
