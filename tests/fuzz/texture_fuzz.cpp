// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: an image of any kind as a texture, then looked up.
#include "core/error.hpp"
#include "renderer/textures/texture.hpp"
#include "tests/fuzz/memory_file.hpp"

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>

using namespace obscura;
using namespace obscura::renderer;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    // A header may promise a large image in few bytes: honest, but no use here.
    if (size > 65536) return 0;
    const test::MemoryFile file(data, size);
    try {
        const Texture t = read_texture(file.path(), TextureCoding::srgb, Texture::Edge::repeat);
        double out[Texture::max_planes];
        t.sample(0.3, -0.7, {0.1, 0.05}, {0.001, 0.2}, out);
        for (std::size_t p = 0; p < t.planes(); ++p)
            if (!(out[p] >= -1e-6 && out[p] <= 1 + 1e-6)) std::abort();
    } catch (const InputError& e) {
        if (std::string(e.what()).find('\n') != std::string::npos) std::abort();
    }
    return 0;
}
