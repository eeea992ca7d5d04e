// SPDX-License-Identifier: Apache-2.0
#include "tools/pages/new_file.hpp"

#include "config/keys.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace obscura::tools {
namespace {

constexpr std::size_t line_width = 100;

bool contains(const std::vector<std::string_view>& words, std::string_view word) {
    return std::find(words.begin(), words.end(), word) != words.end();
}

/// `text` in comment lines of at most line_width characters.
std::string comment(std::string_view text) {
    std::string out = "#";
    std::size_t column = 1;
    while (!text.empty()) {
        const std::size_t end = std::min(text.find(' '), text.size());
        if (column > 1 && column + 1 + end > line_width) {
            out += "\n#";
            column = 1;
        }
        out += fmt::format(" {}", text.substr(0, end));
        column += 1 + end;
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return out + "\n";
}

std::string key_text(const config::Key& key, const NewValue* given, bool active) {
    const std::string allowed = allowed_text(key);
    std::string out =
        comment(fmt::format("{}.{}{}", key.help(), allowed.empty() ? "" : fmt::format(" ({})", allowed),
                            key.is_required() ? " Required." : ""));
    out += fmt::format("{}{} = {}\n", given != nullptr && active ? "" : "#", key.name,
                       given != nullptr ? given->value : value_text(key));
    return out;
}

} // namespace

std::string new_file_text(const KeyReference& reference, const NewFile& file) {
    std::string out;
    for (std::size_t at = 0; at < file.introduction.size();) {
        const std::size_t end = std::min(file.introduction.find('\n', at), file.introduction.size());
        out += fmt::format("# {}\n", std::string_view(file.introduction).substr(at, end - at));
        at = end + 1;
    }
    std::size_t used = 0;
    for (const config::DocumentedTable& table : reference.tables) {
        if (contains(file.left_out, table.heading)) continue;
        if (!table.variant.empty() && !contains(file.variants, table.variant)) continue;
        const bool absent = contains(file.absent, table.heading);
        out += "\n";
        if (!table.help.empty()) out += comment(table.help);
        if (table.variant.empty() && !table.heading.empty())
            out += fmt::format("{}{}\n", absent ? "#" : "", table.heading);
        for (const config::Key& key : table.keys) {
            const auto given = std::find_if(file.set.begin(), file.set.end(), [&](const NewValue& value) {
                return value.table == table.heading && value.key == key.name;
            });
            used += given != file.set.end() ? 1 : 0;
            out += key_text(key, given == file.set.end() ? nullptr : &*given, !absent);
        }
    }
    if (used != file.set.size())
        throw std::logic_error(fmt::format("new {} file: {} of {} values name keys that exist",
                                           reference.name, used, file.set.size()));
    return out;
}

} // namespace obscura::tools
