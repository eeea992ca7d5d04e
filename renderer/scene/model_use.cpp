// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene/model_use.hpp"

#include "core/io/path_state.hpp"

#include <fstream>
#include <iterator>
#include <utility>

namespace obscura::scene {
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

std::string text_of_file(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {(std::istreambuf_iterator<char>(in)), {}};
}

std::vector<std::string> quoted_texts(std::string_view text) {
    std::vector<std::string> quoted;
    for (std::size_t begin = text.find('"'); begin != std::string_view::npos; begin = text.find('"', begin)) {
        const std::size_t end = text.find('"', begin + 1);
        if (end == std::string_view::npos) break;
        quoted.emplace_back(text.substr(begin + 1, end - begin - 1));
        begin = end + 1;
    }
    return quoted;
}

} // namespace obscura::scene
