// SPDX-License-Identifier: Apache-2.0
// Models that a daemon's scenes find: beside the scene, in the appliance's folder, shipped.
#pragma once

#include "core/text/enum_names.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::emulator {

/// Where a model stands, in the order in which scenes look.
enum class ModelPlace : std::uint8_t {
    scene,  ///< in the folder of the scene file
    folder, ///< in models.folder
    shipped,
};
constexpr auto enum_names(ModelPlace /*type*/) {
    return std::array{EnumName{ModelPlace::scene, "scene"}, EnumName{ModelPlace::folder, "folder"},
                      EnumName{ModelPlace::shipped, "shipped"}};
}

struct StoredModel {
    std::filesystem::path file; ///< its name ends as its kind does
    ModelPlace place = ModelPlace::folder;
    bool hidden = false; ///< one of the same name stands in a place before

    [[nodiscard]] std::string name() const { return file.filename().string(); }
};

/// The folder of the appliance's models, and the places beside it. Throws service::Failure. Thread-safe, but
/// those who write take turns.
class ModelStore {
public:
    static constexpr std::size_t max_models = 256;
    static constexpr std::uintmax_t max_bytes = 4U << 20; ///< of all models in the folder
    static constexpr std::size_t max_name_bytes = 64;

    /// `folder`: empty: there is none, and nothing can be stored.
    explicit ModelStore(std::filesystem::path folder) : folder_(std::move(folder)) {}

    /// All models, by name; `scene_file` is the scene that is shown. At most 1000 of each place.
    [[nodiscard]] std::vector<StoredModel> list(const std::filesystem::path& scene_file) const;
    /// The model of that name; of several the first that scenes find, or that of `place`.
    [[nodiscard]] StoredModel find(const std::string& name, const std::filesystem::path& scene_file,
                                   std::optional<ModelPlace> place = std::nullopt) const;
    /// The text of a model.
    [[nodiscard]] static std::string text_of(const std::filesystem::path& file);

    /// Stores `text` as a whole, or nothing. Returns the text that was there; none: there was none.
    std::optional<std::string> put(const std::string& name, const std::string& text,
                                   const std::filesystem::path& scene_file);
    /// Returns the text that was there.
    std::string remove(const std::string& name);
    /// Puts back what put() or remove() returned; for a change that was refused afterwards.
    void restore(const std::string& name, const std::optional<std::string>& text);

    [[nodiscard]] const std::filesystem::path& folder() const noexcept { return folder_; }

    /// Throws Failure unless `name` is a plain file name with the ending of a kind.
    static void check_name(const std::string& name);
    /// `text` as a file of it is read. Throws Failure for what is no text, or too long.
    [[nodiscard]] static std::string checked_text(std::string text);

private:
    [[nodiscard]] std::filesystem::path own_file(const std::string& name) const;
    void write(const std::string& name, const std::string& text) const;

    const std::filesystem::path folder_;
};

/// Whether the scene file names the model in quotes, with or without its ending.
[[nodiscard]] bool scene_names_model(const std::filesystem::path& scene_file, const std::string& name);

} // namespace obscura::emulator
