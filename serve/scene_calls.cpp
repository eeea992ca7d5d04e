// SPDX-License-Identifier: Apache-2.0
#include "serve/scene_calls.hpp"

#include "config/section.hpp"
#include "core/error.hpp"
#include "core/io/path_below.hpp"
#include "core/io/path_state.hpp"
#include "core/text/printable.hpp"
#include "renderer/scene_files/scene_section.hpp"
#include "service/failure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

namespace obscura::serve {
namespace {

using nlohmann::json;
using service::Answer;
using service::Failure;
using service::FailureCode;
using service::Fields;
using service::Permission;
using service::Work;

Failure bad_scene_argument(const std::string& field, const std::string& what) {
    return service::bad_argument(field, fmt::format("{}: {}", field, what));
}

/// A scene file that holds only this table, or this element of an array of tables.
config::Value wrapped(const std::string& section, config::Value table) {
    if (section == "scene") return table;
    config::Value value;
    if (scene::is_list_section(section)) {
        value.kind = config::Value::Kind::array;
        value.items.push_back(std::move(table));
    } else {
        value = std::move(table);
    }
    config::Value root;
    root.members.push_back({section, {}, std::move(value)});
    return root;
}

constexpr std::string_view section_help =
    "Table of the scene file: "
    "\"camera\", \"sun\", \"stars\", \"scene\" for the keys before the first table, or an array of tables such as \"body\" or \"lamp\"";
constexpr std::string_view item_help = "Which element of an array of tables: its name, or its number from 0";

} // namespace

/// Arguments of scene.load.
struct SceneCalls::Load { // NOLINT(bugprone-exception-escape): json does not throw when moved
    std::string file;
    json toml, tree;

    Fields fields() {
        return {{config::key("file", &file)
                     .help("Name of a shipped scene, or of a file below the server's folder")},
                {{"toml", "string", "Text of a scene file", &toml},
                 {"scene", "map", "Tables and keys of a scene file", &tree}}};
    }
};

/// A table, or an element of an array of tables.
struct SceneCalls::Place { // NOLINT(bugprone-exception-escape): json does not throw when moved
    std::string section;
    json item_json;

    Fields fields() {
        return {{config::key("section", &section).required().help(section_help)},
                {{"item", "string or integer", item_help, &item_json}}};
    }
    [[nodiscard]] std::optional<scene::SceneDocument::Item> item() const {
        if (item_json.is_null()) return {};
        if (item_json.is_string()) return item_json.get<std::string>();
        if (item_json.is_number_integer() && item_json.get<std::int64_t>() >= 0)
            return item_json.get<std::size_t>();
        throw bad_scene_argument("item", "allowed a name, or a number from 0");
    }
};

/// Keys of a table.
// NOLINTNEXTLINE(bugprone-exception-escape): json does not throw when moved
struct SceneCalls::Edit : SceneCalls::Place {
    json keys;

    Fields fields() {
        Fields all = Place::fields();
        all.free.push_back(
            {"keys", "map", "Keys of scene files and their values; nil removes a key", &keys, true});
        return all;
    }
    /// Throws Failure.
    [[nodiscard]] std::vector<scene::SceneDocument::Change> changes() const {
        if (!keys.is_object()) throw bad_scene_argument("keys", "allowed a map");
        std::vector<scene::SceneDocument::Change> changes;
        for (const auto& [name, value] : keys.items()) {
            changes.push_back({name});
            if (!value.is_null()) changes.back().value = service::value_of(value, name);
        }
        return changes;
    }
    [[nodiscard]] config::Value table() const {
        config::Value table;
        for (const scene::SceneDocument::Change& change : changes())
            if (change.value) table.members.push_back({change.key, {}, *change.value});
        return table;
    }
};

SceneCalls::SceneCalls(std::filesystem::path root, std::vector<std::filesystem::path> further)
    : root_(std::move(root)), further_(std::move(further)), document_(config::Value{}, own_file()) {}

void SceneCalls::check_scene(const std::function<void()>& work) const {
    const auto translate = [this](std::string text) {
        std::string line = text.substr(0, text.find('\n'));
        // "FILE:LINE:COLUMN: KEY: what" becomes "scene:LINE:COLUMN: KEY: what".
        for (const std::filesystem::path& path : {document_.file(), own_file()})
            if (const std::string file = path.string(); line.starts_with(file))
                line = "scene" + line.substr(file.size());
        const std::string folder = root_.string() + "/";
        for (std::size_t at = line.find(folder); at != std::string::npos; at = line.find(folder))
            line.erase(at, folder.size());
        Failure failure(FailureCode::bad_scene, line);
        const std::size_t begin = line.find(": ");
        const std::size_t end = begin == std::string::npos ? begin : line.find(": ", begin + 2);
        if (line.starts_with("scene") && end != std::string::npos)
            failure.field = line.substr(begin + 2, end - begin - 2);
        constexpr std::string_view allowed = ", allowed ";
        if (const std::size_t at = line.find(allowed); at != std::string::npos)
            failure.allowed = line.substr(at + allowed.size());
        if (const auto more = std::count(text.begin(), text.end(), '\n'); more > 0)
            failure.hint = fmt::format("there are {} more mistakes", more);
        return failure;
    };
    try {
        work();
    } catch (const ConfigError& error) {
        throw translate(error.what());
    } catch (const InputError& error) {
        throw translate(error.what());
    }
}

void SceneCalls::check_file(const std::filesystem::path& file, const std::string& name) const {
    const auto inside = [&](const std::filesystem::path& folder) { return is_below(file, folder); };
    if (name.find('\0') == std::string::npos && (inside(root_) || inside(config::shipped_data_folder()) ||
                                                 std::any_of(further_.begin(), further_.end(), inside)))
        return;
    throw ConfigError(fmt::format(
        "\"{}\": only files below the server's folder, and shipped ones, can be used", printable(name)));
}

void SceneCalls::check_files(config::Value root, const std::filesystem::path& file) const {
    scene::visit_files(root, file, [this](const config::Value& value, const std::filesystem::path& folder) {
        check_file(folder / value.string, value.string);
    });
}

std::filesystem::path SceneCalls::file(const config::ShippedFolder& folder, const std::string& name) const {
    if (auto shipped = config::find_shipped(folder, name)) return *shipped;
    std::filesystem::path file = root_ / name;
    check_file(file, name);
    if (!path_exists(file))
        throw InputError(fmt::format("\"{}\": {}", printable(name), config::explain_missing({folder}, name)));
    return file;
}

Answer SceneCalls::load(const Load& load) {
    if ((load.file.empty() ? 0 : 1) + (load.toml.is_null() ? 0 : 1) + (load.tree.is_null() ? 0 : 1) != 1)
        throw bad_scene_argument("file", "one of \"file\", \"toml\" and \"scene\" is wanted");
    if (!load.toml.is_null() && !load.toml.is_string()) throw bad_scene_argument("toml", "allowed a string");
    if (!load.tree.is_null() && !load.tree.is_object()) throw bad_scene_argument("scene", "allowed a map");
    const std::filesystem::path own = own_file();
    check_scene([&] {
        if (!load.file.empty()) {
            const std::filesystem::path file = this->file(config::shipped_scenes, load.file);
            document_ = scene::SceneDocument(config::parse_file(file), file);
            return;
        }
        config::Value root = load.toml.is_null()
                                 ? service::value_of(load.tree, "scene")
                                 : config::parse_text(load.toml.get_ref<const std::string&>(), own.string());
        check_files(root, own);
        document_ = scene::SceneDocument(std::move(root), own);
    });
    const scene::Scene& scene = document_.scene();
    json names = json::array();
    for (const scene::Body& body : scene.bodies)
        names.push_back(body.name);
    Answer answer;
    answer.head["width"] = scene.camera.width;
    answer.head["height"] = scene.camera.height;
    answer.head["bands"] = scene.bands.size();
    answer.head["bodies"] = std::move(names);
    return answer;
}

void SceneCalls::edit(const Edit& edit) {
    const auto item = edit.item();
    const auto changes = edit.changes();
    check_scene([&] {
        check_files(wrapped(edit.section, edit.table()), document_.file());
        document_.set(edit.section, item ? &*item : nullptr, changes);
    });
}

json SceneCalls::sections() {
    json sections = json::array();
    scene::Scene scene;
    for (const config::DocumentedTable& table : config::document(scene::scene_section(scene), "")) {
        json row{{"heading", table.heading}, {"help", table.help}, {"keys", service::describe(table.keys)}};
        if (!table.variant.empty()) row["variant"] = table.variant;
        sections.push_back(std::move(row));
    }
    return sections;
}

service::Calls SceneCalls::calls() {
    using service::call;
    using service::NoArguments;
    service::Calls calls{
        call<Load>("scene.load", Permission::scene,
                   "Replaces the scene: a shipped scene or one of a file, a text, or a map of tables.",
                   [this](const Load& arguments, Work& /*work*/) { return load(arguments); }),
        call<NoArguments>("scene.export", Permission::scene,
                          "The scene as a scene file; `obscura render` makes the same bytes of it.",
                          [this](const NoArguments&, Work& /*work*/) {
                              Answer answer;
                              answer.head["toml"] = document_.text();
                              return answer;
                          }),
        call<Place>("scene.get", Permission::scene,
                    "The keys that a table of the scene, or one of its elements, gives.",
                    [this](const Place& place, Work& /*work*/) {
                        const auto item = place.item();
                        Answer answer;
                        check_scene([&] {
                            answer.head["keys"] =
                                service::json_of(document_.get(place.section, item ? &*item : nullptr));
                        });
                        return answer;
                    }),
        call<Edit>("scene.set", Permission::scene,
                   "Changes keys of a table, or of an element; all of them, or none if one is wrong.",
                   [this](const Edit& arguments, Work& /*work*/) {
                       edit(arguments);
                       return Answer{};
                   }),
        call<Edit>("scene.add", Permission::scene,
                   "Adds an element to an array of tables: a body, a lamp, ...",
                   [this](const Edit& arguments, Work& /*work*/) {
                       if (arguments.item()) throw bad_scene_argument("item", "belongs to scene.set");
                       check_scene([&] {
                           check_files(wrapped(arguments.section, arguments.table()), document_.file());
                           document_.add(arguments.section, arguments.table());
                       });
                       return Answer{};
                   }),
        call<Place>("scene.remove", Permission::scene, "Removes a table, or an element.",
                    [this](const Place& place, Work& /*work*/) {
                        const auto item = place.item();
                        check_scene([&] { document_.remove(place.section, item ? &*item : nullptr); });
                        return Answer{};
                    }),
    };
    calls[0].results = {{"width", "integer", "px", "Width of the camera's sensor"},
                        {"height", "integer", "px", "Height of the camera's sensor"},
                        {"bands", "integer", "", "Number of spectral bands"},
                        {"bodies", "array of strings", "", "Names of the bodies"}};
    calls[1].results = {{"toml", "string", "", "Text of the scene file, names of files absolute"}};
    calls[2].results = {{"keys", "map or array of maps", "",
                         "Keys that are given, and their values; of all elements if none is asked for"}};
    return calls;
}

} // namespace obscura::serve
