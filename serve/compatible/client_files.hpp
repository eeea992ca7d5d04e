// SPDX-License-Identifier: Apache-2.0
// Files of one connection of the published client: what it reads, sends and saves.
#pragma once

#include "serve/compatible/folder_below.hpp"
#include "serve/compatible/resource_table.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace obscura::serve {

/// Reads below the root folder, and writes below the output folder, where names are looked up too: so a file
/// that the client has sent can be used. A name is relative, or absolute below one of the two. Thread-bound.
///
/// All members throw Failure.
class ClientFiles {
public:
    /// `output`: empty: nothing can be written. `max_bytes`: that the client may send in all. `resources`:
    /// files for names that are in neither folder. Throws InputError for folders that are none.
    ClientFiles(std::filesystem::path root, const std::filesystem::path& output, std::uint64_t max_bytes,
                compatible::ResourceTable resources = {});

    /// A file to read: by the current folder, the resource path, its folders (materials, DEM, textures, ...),
    /// the root, the output folder and the table of resources, whichever has it first. None: no such file.
    [[nodiscard]] std::optional<std::filesystem::path> find(const std::string& name) const;
    /// The same, which must be there.
    [[nodiscard]] std::filesystem::path existing(const std::string& name) const;
    /// A file to save; its folder is there already.
    [[nodiscard]] std::filesystem::path place_for(const std::string& name) const;

    /// A message without the names of the two folders.
    [[nodiscard]] std::string without_folders(std::string text) const;

    /// Current folder, "/" for the root.
    [[nodiscard]] std::string folder() const { return "/" + folder_; }
    /// `name` starts from the current folder, or with "/" from the root.
    void change_folder(const std::string& name);
    /// A line for each name in the current folder.
    [[nodiscard]] std::string listing() const;
    [[nodiscard]] const std::string& resource_path() const noexcept { return resource_path_; }
    /// A folder below the root; empty: the root.
    void set_resource_path(const std::string& name);

    /// Writes a part of a file below the output folder, making folders. Not `append`: the file is cut off at
    /// `offset` first.
    void receive(const std::string& name, std::string_view data, std::uint64_t offset, bool append);
    /// Whether the output folder has a file of that content; one without content is made.
    [[nodiscard]] bool has(const std::string& name, const std::string& md5);
    /// Names under which files of the folder `folder` of the client come from now on begin with it.
    void synchronise(std::string folder) { synchronised_ = std::move(folder); }

private:
    /// `name` relative to the root or to the output folder; none: it is absolute and elsewhere.
    [[nodiscard]] static std::optional<std::string> relative(const std::string& name,
                                                             const FolderBelow& folder);
    [[nodiscard]] const FolderBelow& output() const;
    /// Name below the output folder of a file that the client sends.
    [[nodiscard]] std::string sent_name(const std::string& name) const;

    FolderBelow root_;
    compatible::ResourceTable resources_;
    std::optional<FolderBelow> output_;
    std::string folder_, resource_path_, synchronised_;
    std::uint64_t left_bytes_;
};

} // namespace obscura::serve
