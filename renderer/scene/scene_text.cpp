// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene/scene_text.hpp"

#include <fstream>
#include <iterator>

namespace obscura::scene {

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
