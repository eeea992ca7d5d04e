// SPDX-License-Identifier: Apache-2.0
// Scene file in memory that programs edit key by key and write out again.
#pragma once

#include "config/document.hpp"
#include "config/keys.hpp"
#include "renderer/scene/scene.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace obscura::scene {

/// A scene as the tree of its file, and as read from it: what calls build and what a file holds are the same
/// thing. A change is made as a whole, or, if the scene would not be valid, not at all. Thread-bound.
class SceneDocument {
public:
    /// An element of an array of tables: its index, or its name (key `name`).
    using Item = std::variant<std::size_t, std::string>;
    /// New value of a key, or of a table within; none: the key is removed.
    struct Change {
        std::string key;
        std::optional<config::Value> value{};
    };
    /// Called for the value of each key that names files, with the folder that relative names start from. May
    /// change the value, or throw ConfigError.
    using VisitFile = std::function<void(config::Value& value, const std::filesystem::path& folder)>;

    /// The scene of an empty file.
    SceneDocument();
    /// As the scene file `file`, which need not exist: relative names of files start from its folder. Throws
    /// ConfigError with one line for each mistake.
    SceneDocument(config::Value root, std::filesystem::path file);

    [[nodiscard]] const Scene& scene() const noexcept { return scene_; }
    [[nodiscard]] const std::filesystem::path& file() const noexcept { return file_; }
    /// Another number after each change, also than those of other documents.
    [[nodiscard]] std::uint64_t revision() const noexcept { return revision_; }

    /// Changes keys of a table: "camera", "sun", "stars", or "scene" for the keys before the first table; or
    /// of an element of "body", "lamp", "band", ... Throws ConfigError.
    void set(std::string_view section, const Item* item, const std::vector<Change>& changes);
    /// Appends an element to an array of tables. Throws ConfigError.
    void add(std::string_view section, config::Value table);
    /// Removes a table, or an element. Throws ConfigError.
    void remove(std::string_view section, const Item* item);
    /// The table, or the element, with the keys that it gives. Throws ConfigError.
    [[nodiscard]] config::Value get(std::string_view section, const Item* item) const;

    /// The scene file, names of files that exist absolute: the same scene, wherever it is saved.
    [[nodiscard]] std::string text() const;

private:
    [[nodiscard]] config::Value& find(config::Value& root, std::string_view section, const Item* item) const;
    void replace(config::Value root);

    config::Value root_;
    std::filesystem::path file_;
    Scene scene_;
    std::uint64_t revision_ = 0;
};

/// Calls `visit` for each key of the scene file `root` that names files.
void visit_files(config::Value& root, const std::filesystem::path& file,
                 const SceneDocument::VisitFile& visit);

/// Whether scene files have an array of tables of that name; throws ConfigError if they have no table of that
/// name either.
[[nodiscard]] bool is_list_section(std::string_view section);

} // namespace obscura::scene
