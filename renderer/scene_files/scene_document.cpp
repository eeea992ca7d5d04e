// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene_files/scene_document.hpp"

#include "config/section.hpp"
#include "config/toml_text.hpp"
#include "core/error.hpp"
#include "core/text/printable.hpp"
#include "core/text/suggestion.hpp"
#include "renderer/scene_files/model_table.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "renderer/scene_files/scene_section.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <set>
#include <system_error>
#include <utility>

namespace obscura::scene {
namespace {

using config::Member;
using config::Value;

/// Name of the section of the keys before the first table.
constexpr std::string_view root_name = "scene";

/// Keys that name files, by dotted path of their table ("" for the root) without indices.
using FileKeys = std::map<std::string, std::set<std::string, std::less<>>, std::less<>>;

FileKeys read_file_keys() {
    FileKeys files;
    Scene scene;
    for (const config::DocumentedTable& table : document(scene_section(scene), "")) {
        std::string path = table.heading;
        std::erase_if(path, [](char c) { return c == '[' || c == ']'; });
        for (const config::Key& key : table.keys)
            if (std::holds_alternative<config::Path>(key.target) ||
                std::holds_alternative<config::Files>(key.target))
                files[path].emplace(key.name);
    }
    return files;
}

const FileKeys& file_keys() {
    static const FileKeys keys = read_file_keys();
    return keys;
}

bool is_model_table(std::string_view path) {
    return std::find(model_table_paths.begin(), model_table_paths.end(), path) != model_table_paths.end();
}

void visit_table(Value& table, const std::string& path, const std::filesystem::path& folder,
                 const SceneDocument::VisitFile& visit) {
    const auto own = file_keys().find(path);
    for (Member& member : table.members) {
        Value& value = member.value;
        const std::string inner = path.empty() ? member.key : path + "." + member.key;
        const bool names_files = is_model_table(path) ||
                                 (path.starts_with("body.") && table.find("model") != nullptr) ||
                                 (own != file_keys().end() && own->second.contains(member.key));
        if (value.kind == Value::Kind::table) visit_table(value, inner, folder, visit);
        if (value.kind == Value::Kind::string && names_files) visit(value, folder);
        if (value.kind != Value::Kind::array) continue;
        for (Value& item : value.items) {
            if (item.kind == Value::Kind::table) visit_table(item, inner, folder, visit);
            if (item.kind == Value::Kind::string && names_files) visit(item, folder);
        }
    }
}

/// The value of `key`, made if it is not there yet.
Value& member_of(Value& table, std::string_view key, Value::Kind kind) {
    const auto found = std::find_if(table.members.begin(), table.members.end(),
                                    [&](const Member& member) { return member.key == key; });
    if (found != table.members.end()) return found->value;
    Value value;
    value.kind = kind;
    return table.members.emplace_back(Member{std::string(key), {}, std::move(value)}).value;
}

void erase_member(Value& table, std::string_view key) {
    std::erase_if(table.members, [&](const Member& member) { return member.key == key; });
}

[[noreturn]] void refuse(std::string_view section, const std::string& what) {
    throw ConfigError(fmt::format("{}: {}", printable(section, 60), what));
}

/// Index of the element of the list.
std::size_t index_of(const Value& list, std::string_view section, const SceneDocument::Item& item) {
    if (const auto* index = std::get_if<std::size_t>(&item)) {
        if (*index >= list.items.size())
            refuse(section, fmt::format("no element {}, there are {}", *index, list.items.size()));
        return *index;
    }
    const std::string& name = std::get<std::string>(item);
    std::vector<std::string_view> known;
    for (std::size_t i = 0; i < list.items.size(); ++i) {
        const Member* const key = list.items[i].find("name");
        if (key == nullptr) continue;
        if (key->value.string == name) return i;
        known.push_back(key->value.string);
    }
    refuse(section, fmt::format("no element is called \"{}\"{}", printable(name, 60),
                                known.empty() ? "" : ", " + suggestion(name, known)));
}

} // namespace

void visit_files(Value& root, const std::filesystem::path& file, const SceneDocument::VisitFile& visit) {
    visit_table(root, "", file.parent_path(), visit);
}

bool is_list_section(std::string_view name) {
    Scene scene;
    const config::Section section = scene_section(scene);
    std::vector<std::string_view> known{root_name};
    if (name == root_name) return false;
    for (const config::Section& table : section.tables) {
        if (table.name == name) return false;
        known.push_back(table.name);
    }
    for (const config::List& list : section.lists) {
        if (list.name == name) return true;
        known.push_back(list.name);
    }
    refuse(name, "no table of scenes, " + suggestion(name, known));
}

SceneDocument::SceneDocument() : SceneDocument(Value{}, "scene.toml") {}

SceneDocument::SceneDocument(Value root, std::filesystem::path file) : file_(std::move(file)) {
    replace(std::move(root));
}

void SceneDocument::replace(Value root) {
    static std::atomic<std::uint64_t> last{0};
    scene_ = read_scene(root, file_);
    root_ = std::move(root);
    revision_ = ++last;
}

Value& SceneDocument::find(Value& root, std::string_view section, const Item* item) const {
    const bool is_list = is_list_section(section);
    if (is_list && item == nullptr)
        refuse(section, fmt::format("which [[{}]]? Its name, or its number from 0, is wanted", section));
    if (!is_list && item != nullptr) refuse(section, "there is only one");
    if (section == root_name) return root;
    if (!is_list) return member_of(root, section, Value::Kind::table);
    Value& list = member_of(root, section, Value::Kind::array);
    return list.items[index_of(list, section, *item)];
}

void SceneDocument::set(std::string_view section, const Item* item, const std::vector<Change>& changes) {
    Value root = root_;
    Value& table = find(root, section, item);
    for (const Change& change : changes) {
        if (change.value)
            member_of(table, change.key, change.value->kind) = *change.value;
        else
            erase_member(table, change.key);
    }
    replace(std::move(root));
}

void SceneDocument::add(std::string_view section, Value table) {
    if (!is_list_section(section)) refuse(section, "there is only one, set its keys");
    Value root = root_;
    member_of(root, section, Value::Kind::array).items.push_back(std::move(table));
    replace(std::move(root));
}

void SceneDocument::remove(std::string_view section, const Item* item) {
    Value root = root_;
    if (item == nullptr) {
        if (section == root_name) refuse(section, "cannot be removed");
        (void)is_list_section(section);
        erase_member(root, section);
    } else {
        (void)find(root, section, item);
        Value& list = member_of(root, section, Value::Kind::array);
        list.items.erase(list.items.begin() + static_cast<std::ptrdiff_t>(index_of(list, section, *item)));
        if (list.items.empty()) erase_member(root, section);
    }
    replace(std::move(root));
}

Value SceneDocument::get(std::string_view section, const Item* item) const {
    Value root = root_;
    if (item == nullptr && is_list_section(section)) return member_of(root, section, Value::Kind::array);
    Value found = find(root, section, item);
    if (section == root_name)
        std::erase_if(found.members, [](const Member& member) {
            const std::vector<Value>& items = member.value.items;
            return member.value.kind == Value::Kind::table ||
                   (!items.empty() && items.front().kind == Value::Kind::table);
        });
    return found;
}

std::string SceneDocument::text() const {
    Value root = root_;
    visit_files(root, file_, [](Value& value, const std::filesystem::path& folder) {
        std::error_code error;
        const std::filesystem::path path =
            std::filesystem::absolute(folder / value.string, error).lexically_normal();
        if (!value.string.empty() && std::filesystem::exists(path, error)) value.string = path.string();
    });
    return toml_text(root);
}

} // namespace obscura::scene
