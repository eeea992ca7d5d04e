// SPDX-License-Identifier: Apache-2.0
#include "renderer/mesh_files/triangle_mesh.hpp"

#include "core/error.hpp"
#include "core/units.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>

namespace obscura::renderer {
namespace {

Vec3 widen(Vec3f a) {
    return {a.x, a.y, a.z};
}
Vec3f narrow(Vec3 a) {
    return {static_cast<float>(a.x), static_cast<float>(a.y), static_cast<float>(a.z)};
}

/// Facets of a mesh by the places of their corners.
class Facets {
public:
    Facets(const TriangleMesh& mesh, double max_angle_deg)
        : place_(mesh.vertices.size()),
          // A rounding beyond opposite facets.
          least_cosine_(max_angle_deg < 180 ? std::cos(max_angle_deg * degree) : -2) {
        // Vertices at one place have one number.
        std::vector<std::uint32_t> order(mesh.vertices.size());
        std::iota(order.begin(), order.end(), 0U);
        const auto key = [&](std::uint32_t v) {
            const Vec3f& p = mesh.vertices[v];
            return std::tuple(p.x, p.y, p.z);
        };
        std::sort(order.begin(), order.end(),
                  [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
        std::uint32_t places = 0;
        for (std::size_t i = 0; i < order.size(); ++i) {
            if (i > 0 && key(order[i]) != key(order[i - 1])) ++places;
            place_[order[i]] = places;
        }
        starts_.assign(static_cast<std::size_t>(places) + 2, 0);
        for (const auto& t : mesh.triangles)
            for (const std::uint32_t v : t)
                ++starts_[place_[v] + 1];
        std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
        corners_.resize(3 * mesh.triangles.size());
        std::vector<std::size_t> at(starts_.begin(), starts_.end() - 1);
        for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
            const auto& t = mesh.triangles[i];
            const Vec3 p[3] = {widen(mesh.vertices[t[0]]), widen(mesh.vertices[t[1]]),
                               widen(mesh.vertices[t[2]])};
            normals_.push_back(normalized(cross(p[1] - p[0], p[2] - p[0])));
            for (int k = 0; k < 3; ++k) {
                const Vec3 a = normalized(p[(k + 1) % 3] - p[k]);
                const Vec3 b = normalized(p[(k + 2) % 3] - p[k]);
                corners_[at[place_[t[static_cast<std::size_t>(k)]]]++] = {
                    i, std::atan2(length(cross(a, b)), dot(a, b))};
            }
        }
    }

    /// Normal of facet `i` at its vertex `v`.
    [[nodiscard]] Vec3f corner_normal(std::size_t i, std::uint32_t v) const {
        Vec3 sum;
        for (std::size_t c = starts_[place_[v]]; c < starts_[place_[v] + 1]; ++c)
            if (dot(normals_[i], normals_[corners_[c].facet]) >= least_cosine_)
                sum = sum + corners_[c].angle_rad * normals_[corners_[c].facet];
        const double n = length(sum);
        return n > 1e-9 ? narrow(sum / n) : narrow(normals_[i]);
    }

private:
    struct Corner {
        std::size_t facet;
        double angle_rad;
    };
    std::vector<std::uint32_t> place_; ///< of each vertex
    double least_cosine_;
    std::vector<std::size_t> starts_; ///< of the corners of each place, and the end
    std::vector<Corner> corners_;
    std::vector<Vec3> normals_;
};

} // namespace

void validate(TriangleMesh& mesh, const std::string& source) {
    if (mesh.triangles.empty())
        throw InputError(fmt::format("{}: no triangles: a mesh needs at least one face", source));
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
        if (!is_finite(widen(mesh.vertices[i])))
            throw InputError(fmt::format(
                "{}: vertex {} is not finite in metres as a 32-bit number (at most 3.4e38)", source, i + 1));
    for (std::size_t i = 0; i < mesh.uvs.size(); ++i)
        if (!std::isfinite(mesh.uvs[i][0]) || !std::isfinite(mesh.uvs[i][1]))
            throw InputError(fmt::format("{}: texture coordinate {} is not finite", source, i + 1));
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
        for (const std::uint32_t index : mesh.triangles[i])
            if (index >= mesh.vertices.size())
                throw InputError(fmt::format("{}: face {} uses vertex {}: there are {}", source, i + 1,
                                             index + 1, mesh.vertices.size()));
    std::size_t kept = 0;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const auto& t = mesh.triangles[i];
        const Vec3 a = widen(mesh.vertices[t[0]]);
        // A smaller area has no direction even in double precision.
        if (length_squared(cross(widen(mesh.vertices[t[1]]) - a, widen(mesh.vertices[t[2]]) - a)) < 1e-280)
            continue;
        if (!mesh.material_slots.empty()) mesh.material_slots[kept] = mesh.material_slots[i];
        mesh.triangles[kept++] = t;
    }
    mesh.triangles.resize(kept);
    if (!mesh.material_slots.empty()) mesh.material_slots.resize(kept);
    if (mesh.triangles.empty())
        throw InputError(fmt::format("{}: every triangle has zero area: nothing could be seen", source));
}

void complete_normals(TriangleMesh& mesh, double max_angle_deg) {
    const bool none = mesh.normals.empty();
    const auto known = [&](std::uint32_t v) { return !none && is_finite(widen(mesh.normals[v])); };
    if (!none && std::all_of(mesh.normals.begin(), mesh.normals.end(),
                             [](const Vec3f& n) { return is_finite(widen(n)); }))
        return;
    const Facets facets(mesh, max_angle_deg);
    if (none) mesh.normals.resize(mesh.vertices.size());
    const std::vector<Vec3f> given = none ? std::vector<Vec3f>{} : mesh.normals;
    constexpr std::uint32_t unused = std::numeric_limits<std::uint32_t>::max();
    // Copies of a vertex, one for each normal: a list by the next copy; of the last `unused`.
    std::vector<std::uint32_t> next(mesh.vertices.size(), unused);
    std::vector<bool> used(mesh.vertices.size(), false);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            std::uint32_t v = mesh.triangles[i][k];
            if (!none && is_finite(widen(given[v]))) continue;
            const Vec3f n = facets.corner_normal(i, v);
            while (used[v] &&
                   !(mesh.normals[v].x == n.x && mesh.normals[v].y == n.y && mesh.normals[v].z == n.z)) {
                if (next[v] == unused) {
                    next[v] = static_cast<std::uint32_t>(mesh.vertices.size());
                    mesh.vertices.push_back(mesh.vertices[v]);
                    mesh.normals.push_back(n);
                    if (!mesh.uvs.empty()) mesh.uvs.push_back(mesh.uvs[v]);
                    next.push_back(unused);
                    used.push_back(true);
                }
                v = next[v];
            }
            mesh.normals[v] = n;
            used[v] = true;
            mesh.triangles[i][k] = v;
        }
    // Vertices of no facet.
    for (std::size_t v = 0; v < mesh.normals.size(); ++v)
        if (!used[v] && !known(static_cast<std::uint32_t>(v))) mesh.normals[v] = {0, 0, 1};
}

} // namespace obscura::renderer
