// SPDX-License-Identifier: Apache-2.0
// Several mesh files in one: each turned, scaled and moved.
#pragma once

#include "core/geometry.hpp"

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace obscura::renderer {
struct TriangleMesh;
}

namespace obscura::serve::compatible {

/// A mesh file in the frame of the whole.
struct MeshPlace {
    std::filesystem::path file;
    Vec3 position_m{};
    Quat attitude{}; ///< unit
    double scale = 1;
};

/// Reads each file once. Not thread-safe.
class MeshMerger {
public:
    MeshMerger();
    ~MeshMerger();
    MeshMerger(const MeshMerger&) = delete;
    MeshMerger& operator=(const MeshMerger&) = delete;

    /// Radius of the sphere about the middle of the file's bounding box, and that middle. Throws InputError.
    struct Bounds {
        Vec3 middle_m;
        double radius_m = 0;
    };
    [[nodiscard]] Bounds bounds(const std::filesystem::path& file);
    /// Text of an OBJ file, metres, vertices and triangles alone. Throws InputError, and Failure (too_large)
    /// beyond `most` triangles.
    [[nodiscard]] std::string obj(const std::vector<MeshPlace>& places, std::size_t most);

private:
    [[nodiscard]] const renderer::TriangleMesh& mesh(const std::filesystem::path& file);

    std::map<std::filesystem::path, renderer::TriangleMesh> meshes_;
};

} // namespace obscura::serve::compatible
