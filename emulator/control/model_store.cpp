// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/model_store.hpp"

#include "config/shipped_files.hpp"
#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "core/io/temporary_name.hpp"
#include "core/io/text_file.hpp"
#include "core/text/printable.hpp"
#include "core/text/suggestion.hpp"
#include "images/writers/raw.hpp"
#include "models/language/parser.hpp"
#include "models/model/entry_points.hpp"
#include "renderer/scene/scene_text.hpp"
#include "service/failure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <system_error>

namespace obscura::emulator {
namespace {

using service::bad_argument;
using service::Failure;
using service::FailureCode;

constexpr std::size_t max_of_a_place = 1000;

bool is_name_character(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_' || c == '.';
}

Failure bad_name(const std::string& name, std::string_view why) {
    return bad_argument("file", fmt::format("file: \"{}\": {}", printable(name, 100), why));
}

/// Files of `folder` that are models by their names.
std::vector<std::filesystem::path> models_in(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    if (folder.empty()) return files;
    std::error_code error;
    for (const std::filesystem::path& file : paths_in(folder, error)) {
        const std::string name = file.filename().string();
        if (name.front() != '.' && models::unknown_ending(name).empty() && is_file_at(file) &&
            files.size() < max_of_a_place)
            files.push_back(file);
    }
    return files;
}

std::filesystem::path folder_of(ModelPlace place, const std::filesystem::path& scene_file,
                                const std::filesystem::path& own) {
    switch (place) {
    case ModelPlace::scene:
        return scene_file.parent_path();
    case ModelPlace::folder:
        return own;
    case ModelPlace::shipped:
        break;
    }
    return config::shipped_data_folder() / "models";
}

constexpr std::array places{ModelPlace::scene, ModelPlace::folder, ModelPlace::shipped};

} // namespace

void ModelStore::check_name(const std::string& name) {
    if (name.empty() || name.size() > max_name_bytes || name.front() == '.' ||
        !std::all_of(name.begin(), name.end(), is_name_character))
        throw bad_name(name, fmt::format("allowed are at most {} letters, digits and - _ ., no folders",
                                         max_name_bytes));
    if (const std::string why = models::unknown_ending(name); !why.empty()) throw bad_name(name, why);
}

std::string ModelStore::checked_text(std::string text) {
    const auto refuse = [](const std::string& why) { return bad_argument("text", "text: " + why); };
    if (text.size() > models::max_source_bytes)
        throw refuse(fmt::format("{} bytes, allowed are {}", text.size(), models::max_source_bytes));
    if (const std::string why = make_plain_text(text); !why.empty()) throw refuse(why);
    return text;
}

std::vector<StoredModel> ModelStore::list(const std::filesystem::path& scene_file) const {
    std::vector<StoredModel> all;
    std::set<std::string> seen;
    for (const ModelPlace place : places)
        for (const std::filesystem::path& file : models_in(folder_of(place, scene_file, folder_)))
            all.push_back({file, place, !seen.insert(file.filename().string()).second});
    std::stable_sort(all.begin(), all.end(),
                     [](const StoredModel& a, const StoredModel& b) { return a.name() < b.name(); });
    return all;
}

StoredModel ModelStore::find(const std::string& name, const std::filesystem::path& scene_file,
                             std::optional<ModelPlace> wanted) const {
    check_name(name);
    for (const ModelPlace place : places) {
        if (wanted && *wanted != place) continue;
        const std::filesystem::path folder = folder_of(place, scene_file, folder_);
        if (!folder.empty() && is_file_at(folder / name)) return {folder / name, place};
    }
    std::vector<std::string> names;
    for (const StoredModel& model : list(scene_file))
        names.push_back(model.name());
    throw bad_name(name, fmt::format("no such model{}", did_you_mean(name, {names.begin(), names.end()})));
}

std::string ModelStore::text_of(const std::filesystem::path& file) {
    std::string text;
    if (const std::string why = read_plain_text(file, models::max_source_bytes, text); !why.empty())
        throw Failure(FailureCode::not_now, fmt::format("{}: {}", file.filename().string(), why));
    return text;
}

std::filesystem::path ModelStore::own_file(const std::string& name) const {
    check_name(name);
    if (folder_.empty())
        throw Failure(FailureCode::not_now,
                      "the configuration has no folder for models: models.folder, or a service's own");
    return folder_ / name;
}

void ModelStore::write(const std::string& name, const std::string& text) const {
    const std::filesystem::path file = folder_ / name;
    std::error_code error;
    if (std::filesystem::create_directories(folder_, error))
        std::filesystem::permissions(folder_,
                                     std::filesystem::perms::owner_all | std::filesystem::perms::group_read |
                                         std::filesystem::perms::group_exec,
                                     error);
    remove_left_temporaries(file);
    try {
        images::write_text(file, text);
    } catch (const OutputError& failed) {
        throw Failure(FailureCode::not_now, failed.what());
    }
}

std::optional<std::string> ModelStore::put(const std::string& name, const std::string& text,
                                           const std::filesystem::path& scene_file) {
    const std::filesystem::path file = own_file(name);
    if (is_file_at(scene_file.parent_path() / name))
        throw bad_name(name, "stands beside the scene, which scenes find first: choose another name");
    std::uintmax_t bytes = text.size();
    std::size_t count = 1;
    for (const std::filesystem::path& other : models_in(folder_))
        if (other != file) {
            bytes += file_bytes_at(other);
            ++count;
        }
    if (count > max_models || bytes > max_bytes)
        throw Failure(
            FailureCode::too_large,
            fmt::format("the folder of models would have {} files of {} bytes: allowed are {} of {}", count,
                        bytes, max_models, max_bytes));
    std::optional<std::string> before;
    if (is_file_at(file)) before = text_of(file);
    write(name, text);
    return before;
}

std::string ModelStore::remove(const std::string& name) {
    const std::filesystem::path file = own_file(name);
    if (!is_file_at(file)) throw bad_name(name, "no such model in the folder of models");
    std::string before = text_of(file);
    std::error_code error;
    std::filesystem::remove(file, error);
    if (error)
        throw Failure(FailureCode::not_now, fmt::format("{}: cannot be removed: {}", name, error.message()));
    return before;
}

void ModelStore::restore(const std::string& name, const std::optional<std::string>& text) {
    if (text) return write(name, *text);
    std::error_code error;
    std::filesystem::remove(own_file(name), error);
}

bool scene_names_model(const std::filesystem::path& scene_file, const std::string& name) {
    const std::vector<std::string> quoted = scene::quoted_texts(scene::text_of_file(scene_file));
    const std::string stem = std::filesystem::path(name).stem().string();
    return std::any_of(quoted.begin(), quoted.end(),
                       [&](const std::string& text) { return text == name || text == stem; });
}

} // namespace obscura::emulator
