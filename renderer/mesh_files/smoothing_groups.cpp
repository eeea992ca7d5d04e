// SPDX-License-Identifier: Apache-2.0
#include "renderer/mesh_files/smoothing_groups.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace obscura::renderer {
namespace {

std::size_t little_endian(std::string_view bytes, std::size_t at, std::size_t count) {
    std::size_t value = 0;
    for (std::size_t i = count; i-- > 0;)
        value = value << 8 | static_cast<std::uint8_t>(bytes[at + i]);
    return value;
}

} // namespace

bool has_smoothing_groups(std::string_view bytes) {
    constexpr std::size_t header = 6;
    while (bytes.size() >= header) {
        const std::size_t name = little_endian(bytes, 0, 2);
        if (name == 0x4150) return true;
        const std::size_t size = std::max(little_endian(bytes, 2, 4), header);
        bytes.remove_prefix(header);
        // The walk goes into the chunks that lead there, and past the others.
        std::size_t past = size - header;
        if (name == 0x4D4D || name == 0x3D3D || name == 0x4100) past = 0;
        if (name == 0x4000) past = std::min(bytes.find('\0'), bytes.size()) + 1;
        if (name == 0x4120) past = bytes.size() < 2 ? 2 : 2 + 8 * little_endian(bytes, 0, 2);
        bytes.remove_prefix(std::min(past, bytes.size()));
    }
    return false;
}

} // namespace obscura::renderer
