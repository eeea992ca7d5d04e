// SPDX-License-Identifier: Apache-2.0
// Look-up by name of the files that come with the program: sensors, scenes, models, star catalogues.
#pragma once

#include "config/keys.hpp"

#include <filesystem>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::config {

/// Folder of shipped files, in the source tree below config/, installed below share/obscura/.
struct ShippedFolder {
    std::string_view name;   ///< "sensors"
    std::string_view ending; ///< of its files: ".toml"
    std::string_view one;    ///< what a file is, for messages: "sensor"
};
inline constexpr ShippedFolder shipped_sensors{"sensors", ".toml", "sensor"};
inline constexpr ShippedFolder shipped_scenes{"scenes", ".toml", "scene"};
inline constexpr ShippedFolder shipped_stars{"stars", ".csv", "star catalogue"};

/// Folder of these folders: beside the program's own installation (../share/obscura), else that of the source
/// tree that it was built from, else that of the installation prefix; empty if none exists.
[[nodiscard]] const std::filesystem::path& shipped_data_folder();

/// The files of the folder, sorted by name.
[[nodiscard]] std::vector<std::filesystem::path> shipped_files(const ShippedFolder& folder);

/// The shipped file `name` ("has2"); nothing if there is none, or if `name` is a path: has a "/", begins with
/// "." or ends as the files of the folder do.
[[nodiscard]] std::optional<std::filesystem::path> find_shipped(const ShippedFolder& folder,
                                                                std::string_view name);

/// 'no such file, and no shipped sensor: there are cmv4000, has2; did you mean "has2"?' if `name` could be
/// one, without the question if none is close; "no such file" for a path.
[[nodiscard]] std::string explain_missing(std::initializer_list<ShippedFolder> folders,
                                          std::string_view name);

/// The argument of a program: the file `name` if there is one, else the shipped file of that name, else
/// `name` if it is a path. Throws InputError.
[[nodiscard]] std::filesystem::path file_or_shipped(const ShippedFolder& folder, const std::string& name);

/// File that the value of a key names: `path`, which is the value seen from the folder of its file, if that
/// exists, else the shipped file of that name. Throws ConfigError at the value.
[[nodiscard]] std::string file_of_key(const Value& value, const Where& where, const std::string& path,
                                      const ShippedFolder& folder);

} // namespace obscura::config
