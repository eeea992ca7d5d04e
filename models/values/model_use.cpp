// SPDX-License-Identifier: Apache-2.0
#include "models/values/model_use.hpp"

#include "core/io/path_state.hpp"

#include <utility>

namespace obscura::models {
namespace {

thread_local const UseModels* current_use = nullptr;

} // namespace

UseModels::UseModels(ModelUse use) : use_(std::move(use)), before_(std::exchange(current_use, this)) {}

UseModels::~UseModels() {
    current_use = before_;
}

const ModelUse& UseModels::current() noexcept {
    static const ModelUse plain;
    return current_use != nullptr ? current_use->use_ : plain;
}

std::optional<std::filesystem::path> find_model(const std::filesystem::path& folder, std::string_view name,
                                                std::string_view ending) {
    if (folder.empty() || name.empty() || name.front() == '.' || name.find('/') != std::string_view::npos)
        return std::nullopt;
    std::string file(name);
    if (!name.ends_with(ending)) file += ending;
    if (!is_file_at(folder / file)) return std::nullopt;
    return folder / file;
}

} // namespace obscura::models
