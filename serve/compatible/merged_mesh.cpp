// SPDX-License-Identifier: Apache-2.0
#include "serve/compatible/merged_mesh.hpp"

#include "renderer/mesh_files/mesh_file.hpp"
#include "service/failure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <limits>

namespace obscura::serve::compatible {
namespace {

Vec3 double_of(const renderer::Vec3f& v) {
    return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

} // namespace

MeshMerger::MeshMerger() = default;
MeshMerger::~MeshMerger() = default;

const renderer::TriangleMesh& MeshMerger::mesh(const std::filesystem::path& file) {
    const auto found = meshes_.find(file);
    if (found != meshes_.end()) return found->second;
    renderer::MeshFileParameters parameters;
    parameters.path = file.string();
    parameters.smooth_normals = false;
    return meshes_.emplace(file, renderer::read_mesh_file(parameters)).first->second;
}

MeshMerger::Bounds MeshMerger::bounds(const std::filesystem::path& file) {
    constexpr double far = std::numeric_limits<double>::infinity();
    Vec3 low{far, far, far}, high{-far, -far, -far};
    const renderer::TriangleMesh& read = mesh(file);
    for (const renderer::Vec3f& vertex : read.vertices) {
        const Vec3 v = double_of(vertex);
        low = {std::min(low.x, v.x), std::min(low.y, v.y), std::min(low.z, v.z)};
        high = {std::max(high.x, v.x), std::max(high.y, v.y), std::max(high.z, v.z)};
    }
    Bounds bounds{(low + high) * 0.5};
    for (const renderer::Vec3f& vertex : read.vertices)
        bounds.radius_m = std::max(bounds.radius_m, length(double_of(vertex) - bounds.middle_m));
    return bounds;
}

std::string MeshMerger::obj(const std::vector<MeshPlace>& places, std::size_t most) {
    std::size_t triangles = 0;
    for (const MeshPlace& place : places)
        if (triangles += mesh(place.file).triangles.size(); triangles > most)
            throw service::Failure(service::FailureCode::too_large,
                                   fmt::format("more than {} triangles in all", most));
    std::string text;
    const auto out = std::back_inserter(text);
    std::size_t first = 1;
    for (const MeshPlace& place : places) {
        const renderer::TriangleMesh& one = mesh(place.file);
        for (const renderer::Vec3f& vertex : one.vertices) {
            const Vec3 v = place.position_m + rotate(place.attitude, double_of(vertex) * place.scale);
            fmt::format_to(out, "v {:.9g} {:.9g} {:.9g}\n", v.x, v.y, v.z);
        }
        for (const auto& corners : one.triangles)
            fmt::format_to(out, "f {} {} {}\n", first + corners[0], first + corners[1], first + corners[2]);
        first += one.vertices.size();
    }
    return text;
}

} // namespace obscura::serve::compatible
