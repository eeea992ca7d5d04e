// SPDX-License-Identifier: Apache-2.0
// What a large mesh costs: bytes per triangle, and the time and memory of reading it.
//
//   mesh_bench [FACETS]       a grid of about so many facets (default 2000000), made and built
//   mesh_bench FILE           a mesh file, read and built
//   mesh_bench FILE assimp    the same through assimp, whatever reader would be chosen
#include "core/error.hpp"
#include "renderer/mesh_files/assimp.hpp"
#include "renderer/mesh_files/mesh_file.hpp"
#include "renderer/shapes/mesh_shape.hpp"
#include "tests/support/wavy_mesh.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <string>

using namespace obscura;
using namespace obscura::renderer;

namespace {

double seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double megabytes_at_most(int who) {
    rusage usage{};
    getrusage(who, &usage);
    return static_cast<double>(usage.ru_maxrss) / 1024;
}

} // namespace

int main(int argc, char* argv[]) {
    const std::string what = argc > 1 ? argv[1] : "2000000";
    try {
        const double start = seconds();
        TriangleMesh mesh;
        if (what.find_first_not_of("0123456789") == std::string::npos)
            mesh = test::wavy_mesh(static_cast<std::uint32_t>(std::sqrt(std::stod(what) / 2)), 628);
        else if (argc > 2)
            mesh = read_with_assimp(what, 1, true);
        else
            mesh = read_mesh_file({what, 1, true});
        const double read = seconds();
        fmt::print(
            "{} triangles, {} vertices, ready in {:.2f} s; at most {:.0f} MB here, {:.0f} MB in the reading "
            "process\n",
            mesh.triangles.size(), mesh.vertices.size(), read - start, megabytes_at_most(RUSAGE_SELF),
            megabytes_at_most(RUSAGE_CHILDREN));
        const auto device = std::make_shared<const EmbreeDevice>();
        const MeshShape shape(device, std::move(mesh));
        const double built = seconds();
        const auto triangles = static_cast<double>(shape.mesh().triangles.size());
        fmt::print(
            "built in {:.2f} s: {:.1f} bytes a triangle, of which Embree's {:.1f}; at most {:.0f} MB\n",
            built - read, static_cast<double>(shape.bytes() + device->bytes()) / triangles,
            static_cast<double>(device->bytes()) / triangles, megabytes_at_most(RUSAGE_SELF));
    } catch (const Error& error) {
        fmt::print(stderr, "{}\n", error.what());
        return 1;
    }
}
