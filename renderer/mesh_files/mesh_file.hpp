// SPDX-License-Identifier: Apache-2.0
// Mesh file reader for all supported formats: triangles in metres.
#pragma once

#include "renderer/mesh_files/triangle_mesh.hpp"
#include "renderer/scene/scene.hpp"

#include <string>
#include <string_view>

namespace obscura::renderer {

/// Parameters of a mesh file (renderer/shapes/mesh.hpp).
struct MeshFileParameters {
    static constexpr std::string_view kind = "mesh";
    static constexpr std::string_view help = "Triangle mesh from a file.";
    /// Default material of a body.
    static constexpr std::string_view own_material = "file";
    using Family = scene::ShapeFamily;

    std::string path;
    double metres_per_unit = 1;
    bool smooth_normals = true; ///< the file's normals, else interpolated ones; false: flat facets
};

/// Reads a mesh: PDS plate models (.tab, .plt) and bare OBJ shape models (only v and f) by own readers, all
/// else through assimp: OBJ with MTL, STL, PLY, 3DS, Collada (.dae), glTF (.gltf, .glb). The body's axes are
/// the file's: neither its unit nor its up axis is applied. With `description.smooth_normals` the result has
/// normals: the file's, else those of complete_normals(). Throws InputError with one line.
///
/// A material library that an OBJ file names and that is not there is logged as a warning.
///
/// Reason for own readers: shape models are large, and errors are reported with their line. A bare OBJ file
/// of 2 M facets (65 MB) takes the own reader 0.6 s and 116 MB in all, assimp 1.1 s and 750 MB in two
/// processes (tests/bench/mesh_bench). Both yield floats, which Embree needs.
[[nodiscard]] TriangleMesh read_mesh_file(const MeshFileParameters& description);

/// Whether an OBJ text has content beside vertices and faces that the bare reader would lose.
[[nodiscard]] bool is_bare_obj(std::string_view text);

} // namespace obscura::renderer
