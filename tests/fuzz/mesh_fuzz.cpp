// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: our own readers of shape models, and what is made of what they read. The formats that
// assimp reads are not in it: assimp breaks down easily, and is kept in a process of its own for that.
//
// Input: a byte that chooses the format (even: OBJ, odd: PDS plates), then the file.
#include "core/error.hpp"
#include "renderer/mesh_files/mesh_file.hpp"
#include "renderer/mesh_files/obj.hpp"
#include "renderer/mesh_files/plate.hpp"
#include "renderer/mesh_files/vertex_normals.hpp"

#include <cmath>
#include <cstdlib>
#include <string>

using namespace obscura;
using namespace obscura::renderer;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size < 1) return 0;
    const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
    try {
        (void)is_bare_obj(text);
        TriangleMesh mesh =
            data[0] % 2 == 0 ? parse_obj(text, "fuzz.obj", 0.5) : parse_plates(text, "fuzz.tab", 0.5);
        if (mesh.triangles.empty()) std::abort();
        for (const auto& t : mesh.triangles)
            for (const std::uint32_t i : t)
                if (i >= mesh.vertices.size() || !std::isfinite(mesh.vertices[i].x)) std::abort();
        complete_normals(mesh);
        for (const Vec3f& n : mesh.normals)
            if (!(std::abs(n.x * n.x + n.y * n.y + n.z * n.z - 1) < 1e-3F)) std::abort();
    } catch (const InputError& e) {
        // One line, whatever the file.
        if (std::string(e.what()).find('\n') != std::string::npos) std::abort();
    }
    return 0;
}
