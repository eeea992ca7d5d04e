// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/kernels/default_ephemeris.hpp"

#include "core/io/path_state.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <string_view>

namespace obscura::ephemeris {
namespace {

constexpr const char* file_name = "obscura/de405.bsp";

/// Value of an environment variable; empty: it is not set.
std::string variable(const char* name) {
    const char* const value = std::getenv(name);
    return value == nullptr ? "" : value;
}

/// Folder of the user's data; empty: the user has none.
std::filesystem::path user_folder() {
    std::filesystem::path folder = variable("XDG_DATA_HOME");
    if (folder.is_absolute()) return folder;
    folder = variable("HOME");
    return folder.is_absolute() ? folder / ".local/share" : std::filesystem::path();
}

std::vector<std::filesystem::path> machine_folders() {
    std::string all = variable("XDG_DATA_DIRS");
    if (all.empty()) all = "/usr/local/share:/usr/share";
    std::vector<std::filesystem::path> folders;
    for (std::size_t begin = 0; begin <= all.size();) {
        const std::size_t end = std::min(all.find(':', begin), all.size());
        const std::filesystem::path folder = all.substr(begin, end - begin);
        if (folder.is_absolute()) folders.push_back(folder);
        begin = end + 1;
    }
    return folders;
}

} // namespace

std::vector<std::filesystem::path> default_ephemeris_places() {
    std::vector<std::filesystem::path> places;
    if (const std::filesystem::path folder = user_folder(); !folder.empty())
        places.push_back(folder / file_name);
    for (const std::filesystem::path& folder : machine_folders())
        places.push_back(folder / file_name);
    return places;
}

std::optional<std::filesystem::path> find_default_ephemeris() {
    for (const std::filesystem::path& place : default_ephemeris_places())
        if (is_file_at(place)) return place;
    return std::nullopt;
}

std::filesystem::path place_of_new_default_ephemeris() {
    const std::vector<std::filesystem::path> folders = machine_folders();
    const bool machine = ::geteuid() == 0 || user_folder().empty();
    return (machine && !folders.empty() ? folders.front() : user_folder()) / file_name;
}

} // namespace obscura::ephemeris
