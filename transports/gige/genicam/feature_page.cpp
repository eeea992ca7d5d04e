// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/genicam/feature_page.hpp"

#include <fmt/format.h>

#include <array>
#include <string_view>

namespace obscura::transports::gige {
namespace {

constexpr std::string_view page_head = R"(# GenICam features

The features of the GigE Vision camera, by category. Made from the feature table in `transports/gige/device`
(`obscura_describe_features page`); do not edit. `*`: not in SFNC. `Name[Selector]`: one value for each item of the
selector. Level: Beginner (empty), Expert, Guru. Locked: cannot be written while frames are acquired. User set: stored by
UserSetSave. Bit 0 of a register is the most significant one.
)";

constexpr std::array<std::string_view, 7> type_names{"integer", "float",  "enumeration", "boolean",
                                                     "command", "string", "integer"};
constexpr std::array<std::string_view, 4> level_names{"", "Expert", "Guru", "Invisible"};

std::string escaped_cell(std::string_view text) {
    std::string out;
    for (const char c : text) {
        if (c == '|') out += '\\';
        out += c;
    }
    return out;
}

std::string limit(const Feature& f, const FeatureBound& bound, std::string_view suffix) {
    if (bound.fixed) return fmt::format("{:.10g}", *bound.fixed);
    return bound.address != 0 ? fmt::format("{}{}", f.name, suffix) : std::string(bound.held_by);
}

std::string range(const Feature& f) {
    std::string text;
    if (f.entries.size() > 8 && !f.entries_below.empty())
        return fmt::format("{} to {}, of which {}", f.entries.front().name, f.entries.back().name,
                           f.entries_below);
    for (const FeatureEntry& e : f.entries)
        text += fmt::format("{}{}{}", text.empty() ? "" : ", ", e.name, e.custom ? "*" : "");
    const bool constant =
        f.type == FeatureType::integer && !f.has_register() && !f.chunk && f.value_of.empty();
    if (constant && f.access == Access::read_only) return fmt::format("{}", f.constant);
    if (f.minimum.given() || f.maximum.given())
        text =
            fmt::format("{} to {}", limit(f, f.minimum, minimum_suffix), limit(f, f.maximum, maximum_suffix));
    if (f.increment.given()) text += fmt::format(", in steps of {}", limit(f, f.increment, increment_suffix));
    return text;
}

std::string_view access(const Feature& f) {
    if (f.type == FeatureType::command) return "W";
    return f.access == Access::read_only || f.type == FeatureType::formula ? "R" : "RW";
}

std::string place(const Feature& f) {
    if (f.chunk) return fmt::format("chunk {:08X} + 0x{:X}", chunk_id(*f.chunk), f.address);
    if (!f.has_register()) return f.value_of.empty() ? "" : fmt::format("as {}", f.value_of);
    std::string text = fmt::format("0x{:04X}", f.address);
    if (f.bits.given() && f.bits.lsb == f.bits.msb) text += fmt::format(", bit {}", f.bits.lsb);
    if (f.bits.lsb != f.bits.msb) text += fmt::format(", bits {} to {}", f.bits.msb, f.bits.lsb);
    if (f.stride != 0) text += fmt::format(" + {} n", f.stride);
    return text;
}

std::string row(const Feature& f) {
    const bool writable =
        f.access == Access::read_write && f.has_register() && f.type != FeatureType::command;
    const bool own = f.address >= manufacturer_begin;
    const bool locked = f.lock != FeatureLock::none || !f.locked_by.empty();
    return fmt::format("| {}{}{} | {} | {} | {} | {} | {} | {} | {} | {} | {} |\n", f.name,
                       f.custom ? "*" : "", f.selectors[0].empty() ? "" : fmt::format("[{}]", f.selectors[0]),
                       type_names[static_cast<std::size_t>(f.type)], access(f), f.unit, range(f),
                       level_names[static_cast<std::size_t>(f.visibility)], locked ? "yes" : "",
                       writable && own && f.in_user_set ? "yes" : "", place(f), escaped_cell(f.tooltip));
}

} // namespace

std::string feature_page(std::span<const FeatureCategory> table) {
    std::string page(page_head);
    for (const FeatureCategory& category : table) {
        page += fmt::format("\n## {}{}\n\n", category.name, category.custom ? "*" : "");
        page +=
            "| Feature | Type | Access | Unit | Range | Level | Locked | User set | Register | Description |\n"
            "|---|---|---|---|---|---|---|---|---|---|\n";
        for (const Feature& f : category.features)
            if (f.listed) page += row(f);
    }
    return page;
}

} // namespace obscura::transports::gige
