// SPDX-License-Identifier: Apache-2.0
// Where scenes and sensors find models beside their own folder, and how the programs of these run.
#pragma once

#include "models/program/execution.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace obscura::models {

/// What a program that reads scenes and sensors says of the models in them.
struct ModelUse {
    std::filesystem::path folder{}; ///< of models, searched before the shipped ones; empty: none
    Execution execution{};
};

/// While it lives, files that its thread reads use models so; the innermost counts. Thread-bound.
class UseModels {
public:
    explicit UseModels(ModelUse use);
    ~UseModels();
    UseModels(const UseModels&) = delete;
    UseModels& operator=(const UseModels&) = delete;

    /// What holds on this thread.
    [[nodiscard]] static const ModelUse& current() noexcept;

private:
    ModelUse use_;
    const UseModels* before_;
};

/// The file in `folder` that a scene or sensor calls `name`, with or without `ending`; nothing: there is
/// none, or `name` is a path.
[[nodiscard]] std::optional<std::filesystem::path> find_model(const std::filesystem::path& folder,
                                                              std::string_view name, std::string_view ending);

} // namespace obscura::models
