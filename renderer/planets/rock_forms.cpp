// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/rock_forms.hpp"

#include "core/geometry.hpp"
#include "core/philox.hpp"
#include "renderer/mesh_files/vertex_normals.hpp"
#include "renderer/shapes/procedural_body.hpp"

#include <algorithm>

namespace obscura::renderer {
namespace {

constexpr std::uint32_t subdivisions = 4; ///< 5,120 facets: an edge is a 25th of the rock
constexpr std::uint32_t cuts = 14;
constexpr double nearest_cut = 0.78, farthest_cut = 0.95; ///< of the ball's radius

struct Cut {
    Vec3 normal;
    double distance;
};

std::vector<Cut> make_cuts(std::uint32_t form) {
    std::vector<Cut> made;
    for (std::uint32_t attempt = 0; made.size() < cuts; ++attempt) {
        const auto w = philox4x32({form, attempt, 0, 0x726f636b}, philox_key(1));
        const Vec3 p{2 * uniform_double(w[0]) - 1, 2 * uniform_double(w[1]) - 1,
                     2 * uniform_double(w[2]) - 1};
        const double square = length_squared(p);
        if (square > 1 || square < 0.01) continue; // uniform on the sphere
        made.push_back({normalized(p), nearest_cut + uniform_double(w[3]) * (farthest_cut - nearest_cut)});
    }
    return made;
}

TriangleMesh make_form(std::uint32_t form) {
    const std::vector<Cut> made = make_cuts(form);
    TriangleMesh mesh = make_icosphere(subdivisions);
    std::vector<Vec3> points;
    Vec3 least{1, 1, 1}, largest{-1, -1, -1};
    for (const Vec3f& vertex : mesh.vertices) {
        const Vec3 n = normalized(Vec3{vertex.x, vertex.y, vertex.z});
        double radius = 1;
        for (const Cut& cut : made)
            if (const double along = dot(n, cut.normal); along > 0)
                radius = std::min(radius, cut.distance / along);
        const Vec3 p = radius * n;
        points.push_back(p);
        least = {std::min(least.x, p.x), std::min(least.y, p.y), std::min(least.z, p.z)};
        largest = {std::max(largest.x, p.x), std::max(largest.y, p.y), std::max(largest.z, p.z)};
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
        const auto within = [](double x, double low, double high) {
            return static_cast<float>((2 * x - low - high) / (high - low));
        };
        mesh.vertices[i] = {within(points[i].x, least.x, largest.x), within(points[i].y, least.y, largest.y),
                            within(points[i].z, least.z, largest.z)};
    }
    complete_normals(mesh, 180);
    return mesh;
}

} // namespace

std::vector<TriangleMesh> make_rock_forms() {
    std::vector<TriangleMesh> forms;
    for (std::uint32_t form = 0; form < rock_form_count; ++form)
        forms.push_back(make_form(form));
    return forms;
}

} // namespace obscura::renderer
