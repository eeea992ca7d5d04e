// SPDX-License-Identifier: Apache-2.0
// Mesh files of any format that is known here, as triangles in metres.
#pragma once

#include "renderer/mesh_files/triangle_mesh.hpp"
#include "renderer/scene/scene.hpp"

#include <string>
#include <string_view>

namespace obscura::renderer {

/// Which mesh file, and how it is taken: the parameters of a shape (renderer/shapes/mesh.hpp).
struct MeshFileParameters {
    static constexpr std::string_view kind = "mesh";
    static constexpr std::string_view help = "Triangle mesh from a file.";
    /// Material of a body that names none.
    static constexpr std::string_view own_material = "file";
    using Family = scene::ShapeFamily;

    std::string path;
    double metres_per_unit = 1;
    bool smooth_normals = true; ///< the file's normals, else interpolated ones; false: flat facets
};

/// Reads a mesh: PDS plate models (.tab, .plt) and bare OBJ shape models (nothing but v and f) by our own
/// readers, all else through assimp: OBJ with MTL, STL, PLY, 3DS, Collada (.dae), glTF (.gltf, .glb). The
/// body's axes are the file's own: neither its unit nor its idea of "up" is applied. With
/// `description.smooth_normals` the result has normals: the file's, else means over the adjoining facets.
/// Throws InputError with one line.
///
/// Why own readers: shape models come large, and an error in them is told with its line. A bare OBJ file of 2
/// M facets (65 MB) takes this reader 2.4 s and 129 MB in all, assimp 55 s and 1.2 GB
/// (tests/bench/mesh_bench, one busy core). Both end in floats, which is what Embree works in.
[[nodiscard]] TriangleMesh read_mesh_file(const MeshFileParameters& description);

/// Whether an OBJ text has anything beside vertices and faces that would be lost on the bare reader.
[[nodiscard]] bool is_bare_obj(std::string_view text);

} // namespace obscura::renderer
