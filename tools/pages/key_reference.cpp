// SPDX-License-Identifier: Apache-2.0
#include "tools/pages/key_reference.hpp"

#include "emulator/config/daemon_config.hpp"
#include "renderer/scene_files/camera_section.hpp"
#include "renderer/scene_files/kernel_keys.hpp"
#include "renderer/scene_files/scene_section.hpp"
#include "sensors/sensor_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace obscura::tools {
namespace {

/// Adds `section` and the tables within it; `prefix` is the dotted path of the tables around it.
void add(std::vector<config::DocumentedTable>& tables, const config::Section& section,
         std::string_view prefix = "") {
    std::vector<config::DocumentedTable> more = config::document(section, prefix);
    std::move(more.begin(), more.end(), std::back_inserter(tables));
}

KeyReference configuration_reference() {
    const auto config = std::make_shared<emulator::DaemonConfig>();
    KeyReference reference{
        "configuration",
        "Configuration of the daemon",
        "A TOML file, read by `obscurad --config FILE` and checked by `obscura check FILE`. "
        "Relative file names start from the folder of the file. "
        "With [[camera]] in place of [camera] a daemon has several cameras; "
        "tables from [trigger] on may then stand within one, as [camera.gige], and override the file's.",
        {},
        config};
    const config::Section root = emulator::root_section(*config);
    for (const config::Section& section : root.tables)
        add(reference.tables, section);
    config::Section view = scene::camera_section(config->scene.camera, std::make_shared<scene::KernelKeys>());
    view.name = "view";
    view.help =
        "Keys of [camera] of the scene file that one of several cameras overrides; within [[camera]] only.";
    add(reference.tables, view, "camera.");
    return reference;
}

KeyReference scene_reference() {
    const auto scene = std::make_shared<scene::Scene>();
    KeyReference reference{
        "scene",
        "Scene file",
        "A TOML file, named by `[scene] file` of a configuration and rendered by `obscura render FILE`. "
        "Relative file names start from the folder of the file. "
        "The keys of a body's shape and material stand beside the body's own. "
        "Trajectories, joint tables and star catalogues, which the file names, are described in docs/tables.md.",
        {},
        scene};
    add(reference.tables, scene::scene_section(*scene));
    return reference;
}

KeyReference sensor_reference() {
    const auto sensor = std::make_shared<SensorDescription>();
    KeyReference reference{
        "sensor",
        "Sensor file",
        "A TOML file, named by `[sensor] file` of a configuration. "
        "Values may stand with their provenance: { value = 8, provenance = \"measured\", source = \"datasheet, page 12\" }.",
        {},
        sensor};
    config::Section root = sensors::section_of(*sensor);
    root.name = {};
    add(reference.tables, root);
    return reference;
}

/// "[[gige.faults]]" without its brackets.
std::string_view path_of(const config::DocumentedTable& table) {
    std::string_view path = table.heading;
    while (!path.empty() && path.front() == '[')
        path.remove_prefix(1);
    while (!path.empty() && path.back() == ']')
        path.remove_suffix(1);
    return path;
}

std::string title_of(const config::DocumentedTable& table) {
    const std::string heading = table.heading.empty() ? "Keys at the root of the file" : table.heading;
    return table.variant.empty() ? heading : fmt::format("{} with {}", heading, table.variant);
}

std::string type_and_range(const config::Key& key) {
    const std::string allowed = allowed_text(key);
    const std::string type = key.choices().empty() ? type_text(key) : "one of";
    return allowed.empty() ? type : fmt::format("{}{} {}", type, key.choices().empty() ? "," : "", allowed);
}

std::string notes_of(const config::Key& key) {
    return fmt::format("{}{}", key.is_required() ? " Required." : "",
                       key.is_reloadable() ? " Reloadable." : "");
}

std::string cell(std::string text) {
    for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2)
        text.insert(at, 1, '\\');
    return text;
}

} // namespace

std::vector<KeyReference> key_references() {
    std::vector<KeyReference> references;
    references.push_back(configuration_reference());
    references.push_back(scene_reference());
    references.push_back(sensor_reference());
    return references;
}

std::string reference_page(const KeyReference& reference) {
    std::string page = fmt::format("# {}\n\nMade by `obscura keys --markdown {}`; do not edit.\n\n{}\n",
                                   reference.title, reference.name, reference.intro);
    for (const config::DocumentedTable& table : reference.tables) {
        page += fmt::format("\n## {}\n", title_of(table));
        if (!table.help.empty()) page += fmt::format("\n{}\n", table.help);
        if (table.keys.empty()) continue;
        page += "\n| key | default | allowed | meaning |\n|---|---|---|---|\n";
        for (const config::Key& key : table.keys)
            page += fmt::format("| `{}` | {} | {} | {}.{} |\n", key.name,
                                key.is_required() ? "" : fmt::format("`{}`", value_text(key)),
                                cell(type_and_range(key)), cell(std::string(key.help())), notes_of(key));
    }
    return page;
}

std::string reference_text(const std::vector<config::DocumentedTable>& tables) {
    std::string text;
    for (const config::DocumentedTable& table : tables) {
        text += fmt::format("{}{}\n", text.empty() ? "" : "\n", title_of(table));
        if (!table.help.empty()) text += fmt::format("  {}\n", table.help);
        for (const config::Key& key : table.keys)
            text += fmt::format("  {}{}\n      {}. {}.{}\n", key.name,
                                key.is_required() ? "" : fmt::format(" = {}", value_text(key)),
                                type_and_range(key), key.help(), notes_of(key));
    }
    return text;
}

std::vector<config::DocumentedTable> find_tables(const KeyReference& reference, std::string_view word) {
    std::vector<config::DocumentedTable> found;
    for (const config::DocumentedTable& table : reference.tables) {
        const std::string_view path = path_of(table);
        const bool within = path == word || path.starts_with(std::string(word) + ".") ||
                            path.ends_with("." + std::string(word));
        const bool variant =
            !table.variant.empty() && table.variant.find(fmt::format("\"{}\"", word)) != std::string::npos;
        if (within || variant) found.push_back(table);
    }
    return found;
}

std::vector<std::string_view> table_words(const std::vector<config::DocumentedTable>& tables) {
    std::vector<std::string_view> words;
    const auto add = [&](std::string_view word) {
        if (!word.empty() && std::find(words.begin(), words.end(), word) == words.end())
            words.push_back(word);
    };
    for (const config::DocumentedTable& table : tables)
        add(path_of(table));
    for (const config::DocumentedTable& table : tables) {
        // As in: shape = "box".
        const std::string_view variant = table.variant;
        const std::size_t first = variant.find('"');
        if (first == std::string_view::npos) continue;
        add(variant.substr(first + 1, variant.find('"', first + 1) - first - 1));
    }
    return words;
}

} // namespace obscura::tools
