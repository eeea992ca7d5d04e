// SPDX-License-Identifier: Apache-2.0
// Calls that build, change and export the scene of a client.
#pragma once

#include "config/document.hpp"
#include "config/shipped_files.hpp"
#include "renderer/scene_files/scene_document.hpp"
#include "service/call.hpp"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::serve {

/// The scene of one client and the calls scene.load, scene.set, ... Files that a client names stand below
/// `root` or are shipped. Thread-bound.
class SceneCalls {
public:
    /// `root`: an absolute folder. `further`: others; empty names are none.
    explicit SceneCalls(std::filesystem::path root, std::vector<std::filesystem::path> further = {});
    SceneCalls(const SceneCalls&) = delete;
    SceneCalls& operator=(const SceneCalls&) = delete;

    [[nodiscard]] service::Calls calls();
    [[nodiscard]] const scene::SceneDocument& document() const noexcept { return document_; }
    /// Tables of scenes and their keys, as `describe` gives them.
    [[nodiscard]] static nlohmann::json sections();
    /// Runs `work`; ConfigError and InputError become Failure (bad_scene) without names of the server's
    /// folders.
    void check_scene(const std::function<void()>& work) const;
    /// Name of scenes that clients send: relative names of files start from its folder.
    [[nodiscard]] std::filesystem::path own_file() const { return root_ / "scene.toml"; }
    /// The shipped file of that name, or the file below root_. Throws ConfigError, InputError.
    [[nodiscard]] std::filesystem::path file(const config::ShippedFolder& shipped,
                                             const std::string& name) const;
    /// Throws ConfigError unless the file may be used.
    void check_file(const std::filesystem::path& file, const std::string& name) const;

private:
    struct Load;
    struct Place;
    struct Edit;

    [[nodiscard]] service::Answer load(const Load& load);
    void edit(const Edit& edit);
    /// Throws ConfigError unless all files may be used that `root`, a scene file below root_, names.
    void check_files(config::Value root, const std::filesystem::path& file) const;

    std::filesystem::path root_;
    std::vector<std::filesystem::path> further_;
    scene::SceneDocument document_;
};

} // namespace obscura::serve
