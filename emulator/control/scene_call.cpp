// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/scene_call.hpp"

#include "config/document.hpp"
#include "config/shipped_files.hpp"
#include "core/error.hpp"
#include "core/io/path_below.hpp"
#include "core/text/printable.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/scene_files/scene_section.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <system_error>
#include <utility>

namespace obscura::emulator {
namespace {

using service::Answer;
using service::bad_argument;
using service::Failure;
using service::FailureCode;
using service::Fields;
using service::Work;

struct SceneArguments {
    std::string file;

    Fields fields() {
        return {{config::key("file", &file)
                     .required()
                     .help("Name of a shipped scene, or of a scene file below control.scenes")}};
    }
};

/// The scene file of that name. Throws Failure.
std::filesystem::path file_of(const std::string& name, const std::filesystem::path& folder) {
    if (auto shipped = config::find_shipped(config::shipped_scenes, name)) return *shipped;
    const auto refuse = [&name](const std::string& why) {
        return bad_argument("file", fmt::format("scene.show: file: \"{}\": {}", printable(name, 200), why));
    };
    if (name.find('\0') != std::string::npos) throw refuse("no such file");
    if (!is_below(folder / name, folder))
        throw refuse("only files below control.scenes, and shipped scenes, can be loaded");
    std::error_code error;
    const std::filesystem::path file = std::filesystem::weakly_canonical(folder / name, error);
    if (error || !std::filesystem::is_regular_file(file, error))
        throw refuse(config::explain_missing({config::shipped_scenes}, name));
    return file;
}

/// Names of the members that a scene file may have.
std::set<std::string, std::less<>> members_of_scenes() {
    scene::Scene unused;
    const config::Section section = scene::scene_section(unused);
    std::set<std::string, std::less<>> names(section.elsewhere.begin(), section.elsewhere.end());
    for (const config::Key& key : section.keys)
        names.emplace(key.name);
    for (const config::Section& table : section.tables)
        names.emplace(table.name);
    for (const config::List& list : section.lists)
        names.emplace(list.name);
    return names;
}

/// Whether the file may be a scene, by the tables that it has.
bool may_be_scene(const std::filesystem::path& file) {
    static const std::set<std::string, std::less<>> members = members_of_scenes();
    constexpr std::uintmax_t max_bytes = 1 << 20;
    std::error_code error;
    if (file.extension() != config::shipped_scenes.ending || !std::filesystem::is_regular_file(file, error) ||
        std::filesystem::file_size(file, error) > max_bytes || error)
        return false;
    try {
        const config::Value table = config::parse_file(file);
        return !table.members.empty() &&
               std::all_of(table.members.begin(), table.members.end(),
                           [](const config::Member& member) { return members.contains(member.key); });
    } catch (const Error&) {
        return false;
    }
}

/// The name by which scene.show takes the file that is shown; else its path.
std::string name_of_scene(const std::filesystem::path& file, const std::filesystem::path& folder) {
    for (const std::filesystem::path& shipped : config::shipped_files(config::shipped_scenes))
        if (shipped == file) return file.stem().string();
    return is_below(file, folder) ? file.lexically_relative(folder).string() : file.string();
}

} // namespace

std::vector<std::string> scene_names(const std::filesystem::path& folder) {
    constexpr int deepest = 3;
    constexpr std::size_t max_viewed = 10'000, most = 1000;
    using Walk = std::filesystem::recursive_directory_iterator;
    std::vector<std::string> own;
    std::error_code error;
    Walk walk(folder, std::filesystem::directory_options::skip_permission_denied, error);
    for (std::size_t i = 0; !error && walk != Walk() && i < max_viewed; walk.increment(error), ++i) {
        if (walk.depth() >= deepest) walk.disable_recursion_pending();
        if (may_be_scene(walk->path())) own.push_back(walk->path().lexically_relative(folder).string());
    }
    std::sort(own.begin(), own.end());
    std::vector<std::string> names;
    for (const std::filesystem::path& shipped : config::shipped_files(config::shipped_scenes))
        names.push_back(shipped.stem().string());
    names.insert(names.end(), own.begin(), own.end());
    names.resize(std::min(names.size(), most));
    return names;
}

service::Calls scene_calls(SceneRequests& requests, const std::filesystem::path& folder,
                           std::function<std::filesystem::path()> shown, ScenesRefused refused) {
    service::Call call = service::call<SceneArguments>(
        "scene.show", service::Permission::scene,
        "Shows another scene. "
        "It is built while frames of the present one continue, and shown from a frame on; "
        "if it cannot be, nothing changes and the answer says why. "
        "A reload of the configuration returns to the scene that stands there.",
        [&requests, folder](const SceneArguments& arguments, Work& work) {
            const std::string why = requests.ask(file_of(arguments.file, folder), work.cancelled());
            if (!why.empty()) throw Failure(FailureCode::bad_scene, why);
            return Answer{{{"shown", requests.shown()}}};
        });
    call.results = {{"shown", "integer", "", "Scenes that have been shown by this call since the start"}};
    service::Call list = service::call<service::NoArguments>(
        "scene.list", service::Permission::view,
        "Lists the scenes that scene.show takes, and says of each that it would refuse now why. Reads their files.",
        [folder, shown = std::move(shown), refused = std::move(refused)](const service::NoArguments&,
                                                                         Work& /*work*/) {
            const std::vector<std::string> names = scene_names(folder);
            std::vector<std::filesystem::path> files;
            for (const std::string& name : names)
                files.push_back(file_of(name, folder));
            const std::vector<std::string> reasons = refused(files);
            nlohmann::json why_not = nlohmann::json::object();
            for (std::size_t i = 0; i < names.size(); ++i)
                if (!reasons.at(i).empty()) why_not[names[i]] = reasons[i];
            return Answer{{{"shown", name_of_scene(shown(), folder)},
                           {"scenes", names},
                           {"why_not", std::move(why_not)}}};
        });
    list.results = {
        {"shown", "string", "", "The scene that is shown; its path if scene.show does not take it"},
        {"scenes", "array of strings", "", "Names of shipped scenes, then of files below control.scenes"},
        {"why_not", "map", "", "By name, for those that cannot be shown now: why, in one line"}};
    return {std::move(call), std::move(list)};
}

} // namespace obscura::emulator
