// SPDX-License-Identifier: Apache-2.0
#include "renderer/mesh_files/assimp_files.hpp"

#include "core/io/text_file.hpp"
#include "core/text/text.hpp"

#include <assimp/MemoryIOWrapper.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string_view>

namespace obscura::renderer {
namespace {

bool is_text_ending(const std::string& ending) {
    constexpr std::array endings{".obj", ".mtl", ".gltf", ".dae", ".ply", ".stl"};
    return std::find(endings.begin(), endings.end(), ending) != endings.end();
}

/// Whether the bytes are those of a format of which a binary form has the same ending.
bool is_binary(std::string_view bytes, const std::string& ending) {
    const std::string_view text = without_byte_order_mark(bytes);
    if (ending == ".ply") {
        const std::string_view header = text.substr(0, 4096);
        return header.find("format ascii") == std::string_view::npos;
    }
    if (ending == ".stl") {
        const auto word = text.substr(std::min(text.find_first_not_of(" \t\r\n"), text.size()), 5);
        // A binary header may begin with this word too: zero bytes, which its numbers have, tell it.
        return lower_case(word) != "solid" || text.find('\0') < 84;
    }
    return false;
}

/// Text of a file that assimp can read, where the bytes of the file are not that text; else no value.
std::optional<std::string> text_for_assimp(const std::string& bytes, const std::string& ending) {
    if (!is_text_ending(ending) || is_binary(bytes, ending)) return std::nullopt;
    std::string text = bytes;
    // UTF-16 and zero bytes within: assimp decides.
    if (!make_plain_text(text).empty()) return std::nullopt;
    if (ending == ".stl")
        std::transform(text.begin(), text.end(), text.begin(),
                       [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
    if (ending == ".obj" || ending == ".mtl")
        for (std::size_t at = text.find("\\\n"); at != std::string::npos; at = text.find("\\\n", at))
            text[at] = text[at + 1] = ' ';
    if (text == bytes) return std::nullopt;
    return text;
}

} // namespace

Assimp::IOStream* AssimpFiles::Open(const char* file, const char* mode) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error)) return nullptr;
    if (const auto [found, fresh] = texts_.try_emplace(file); fresh) {
        const std::string ending = lower_case(std::filesystem::path(file).extension().string());
        if (is_text_ending(ending)) {
            std::ifstream in(file, std::ios::binary);
            std::string bytes(std::filesystem::file_size(file, error), '\0');
            in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
            bytes.resize(static_cast<std::size_t>(in.gcount()));
            found->second = text_for_assimp(bytes, ending);
        }
    }
    const std::optional<std::string>& text = texts_[file];
    Assimp::IOStream* const stream =
        text ? new Assimp::MemoryIOStream(reinterpret_cast<const std::uint8_t*>(text->data()), text->size())
             : Assimp::DefaultIOSystem::Open(file, mode);
    if (stream != nullptr) opened_.emplace_back(file);
    return stream;
}

} // namespace obscura::renderer
