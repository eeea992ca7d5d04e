// SPDX-License-Identifier: Apache-2.0
#include "config/entries.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

namespace obscura::config {
namespace {

std::string joined(const std::string& path, std::string_view name) {
    return path.empty() ? std::string(name) : fmt::format("{}.{}", path, name);
}

/// The section of that name, or none.
const Section* find_table(const std::vector<Section>& tables, std::string_view name) {
    const auto found =
        std::find_if(tables.begin(), tables.end(), [&](const Section& one) { return one.name == name; });
    return found == tables.end() ? nullptr : &*found;
}

bool has_key(const Section& section, std::string_view name) {
    return std::any_of(section.keys.begin(), section.keys.end(),
                       [&](const Key& key) { return key.name == name; });
}

std::string default_of(const Section* fresh, std::string_view name) {
    if (fresh == nullptr) return {};
    const auto key = std::find_if(fresh->keys.begin(), fresh->keys.end(),
                                  [&](const Key& one) { return one.name == name; });
    return key == fresh->keys.end() || key->is_required() ? std::string() : value_text(*key);
}

/// The example that has all printed keys of `element`.
const Section* example_for(const std::vector<Section>& examples, const Section& element) {
    const auto found = std::find_if(examples.begin(), examples.end(), [&](const Section& one) {
        return std::all_of(element.keys.begin(), element.keys.end(),
                           [&](const Key& key) { return !key.is_printed() || has_key(one, key.name); });
    });
    return found == examples.end() ? nullptr : &*found;
}

void add_entries(const Section& section, const Section* fresh, const std::string& path,
                 std::vector<Entry>& entries) {
    for (const Key& key : section.keys)
        if (key.is_printed())
            entries.push_back({joined(path, key.name), value_text(key), std::string(key.unit()),
                               default_of(fresh, key.name)});
    for (const List& list : section.lists) {
        const std::vector<Section> examples = list.examples();
        for (std::size_t i = 0; i < list.size(); ++i) {
            const Section element = list.at(i);
            add_entries(element, example_for(examples, element),
                        fmt::format("{}[{}]", joined(path, list.name), i), entries);
        }
    }
    for (const Section& inner : section.tables)
        if (inner.printed)
            add_entries(inner, fresh == nullptr ? nullptr : find_table(fresh->tables, inner.name),
                        joined(path, inner.name), entries);
}

} // namespace

std::vector<Entry> entries_of(const Section& section, const Section& fresh, const std::string& path) {
    std::vector<Entry> entries;
    if (section.printed) add_entries(section, &fresh, path, entries);
    return entries;
}

void note_sources(const Value& table, const std::string& path, const std::filesystem::path& file,
                  Sources& sources) {
    for (const Member& member : table.members) {
        const std::string here = joined(path, member.key);
        const Value& value = member.value;
        sources[here] = fmt::format("{}:{}", file.string(), member.at.line);
        if (value.kind == Value::Kind::table) note_sources(value, here, file, sources);
        if (value.kind != Value::Kind::array) continue;
        // The elements of another file's list are gone.
        const std::string element = here + "[";
        for (auto one = sources.lower_bound(element);
             one != sources.end() && one->first.starts_with(element);)
            one = sources.erase(one);
        for (std::size_t i = 0; i < value.items.size(); ++i)
            if (value.items[i].kind == Value::Kind::table)
                note_sources(value.items[i], fmt::format("{}[{}]", here, i), file, sources);
    }
}

} // namespace obscura::config
