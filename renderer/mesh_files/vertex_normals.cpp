// SPDX-License-Identifier: Apache-2.0
#include "renderer/mesh_files/vertex_normals.hpp"

#include "core/units.hpp"
#include "renderer/mesh_files/distinct.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace obscura::renderer {
namespace {

/// Facets at a point that are compared pair by pair.
constexpr std::size_t max_compared_facets = 256;

Vec3f to_float(Vec3 a) {
    return {static_cast<float>(a.x), static_cast<float>(a.y), static_cast<float>(a.z)};
}

/// A facet as one of its corners sees it.
struct FacetCorner {
    Vec3 normal; ///< unit
    double angle_rad = 0;
};

FacetCorner facet_corner(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& t, std::size_t k) {
    const auto at = [&](std::size_t i) { return to_double(mesh.vertices[t[i % 3]]); };
    const Vec3 a = normalized(at(k + 1) - at(k));
    const Vec3 b = normalized(at(k + 2) - at(k));
    return {normalized(cross(at(1) - at(0), at(2) - at(0))), std::atan2(length(cross(a, b)), dot(a, b))};
}

/// Unit vector along a sum of normals; those of opposite facets can cancel: `otherwise` stands there.
Vec3f mean_direction(Vec3 sum, Vec3 otherwise) {
    const double n = length(sum);
    return to_float(n > 1e-9 ? sum / n : otherwise);
}

/// Corners at each point of a mesh, 3 * triangle + place, in the triangles' order.
class CornerLists {
public:
    CornerLists(const TriangleMesh& mesh, const std::vector<std::uint32_t>& points, std::uint32_t count)
        : begins_(std::size_t{count} + 1), corners_(3 * mesh.triangles.size()) {
        for (const auto& t : mesh.triangles)
            for (const std::uint32_t v : t)
                ++begins_[points[v]];
        std::uint32_t sum = 0;
        for (std::uint32_t& begin : begins_)
            begin = sum += begin;
        // Filled from the end, which leaves each begin where its list begins.
        for (std::size_t c = corners_.size(); c-- > 0;)
            corners_[--begins_[points[mesh.triangles[c / 3][c % 3]]]] = static_cast<std::uint32_t>(c);
    }

    [[nodiscard]] std::span<const std::uint32_t> at(std::size_t point) const {
        return std::span(corners_).subspan(begins_[point], begins_[point + 1] - begins_[point]);
    }

private:
    std::vector<std::uint32_t> begins_, corners_;
};

/// Normals of the corners at one point by the rule of complete_normals().
void crease_normals(std::span<const FacetCorner> facets, double max_angle_deg, std::vector<Vec3f>& normals) {
    Vec3 sum{};
    for (const FacetCorner& f : facets)
        sum = sum + f.angle_rad * f.normal;
    const double half = std::cos(max_angle_deg / 2 * degree);
    const double whole = std::cos(max_angle_deg * degree);
    const double limit = half * length(sum);
    // Facets within half the angle of a common direction meet at less than the angle.
    const bool smooth =
        max_angle_deg >= 180 || std::all_of(facets.begin(), facets.end(),
                                            [&](const FacetCorner& f) { return dot(f.normal, sum) > limit; });
    normals.clear();
    for (const FacetCorner& own : facets) {
        Vec3 near = sum;
        if (!smooth) near = facets.size() > max_compared_facets ? own.normal : Vec3{};
        if (!smooth && facets.size() <= max_compared_facets)
            for (const FacetCorner& other : facets)
                if (dot(own.normal, other.normal) > whole) near = near + other.angle_rad * other.normal;
        normals.push_back(mean_direction(near, own.normal));
    }
}

/// Gives corners their normals: writes vertices that have none yet, and splits those that have another.
class Splitter {
public:
    Splitter(TriangleMesh& mesh, std::vector<char>& lacking) : mesh_(mesh), lacking_(lacking) {}

    void next_point() { copies_.clear(); }

    void set(std::uint32_t corner, Vec3f normal) {
        std::uint32_t& vertex = mesh_.triangles[corner / 3][corner % 3];
        if (lacking_[vertex] == lacks) {
            mesh_.normals[vertex] = normal;
            lacking_[vertex] = filled;
            return;
        }
        if (is_same(mesh_.normals[vertex], normal)) return;
        const std::size_t oldest = copies_.size() - std::min(copies_.size(), max_compared_facets);
        for (std::size_t i = copies_.size(); i-- > oldest;)
            if (copies_[i].of == vertex && is_same(mesh_.normals[copies_[i].copy], normal)) {
                vertex = copies_[i].copy;
                return;
            }
        const auto copy = static_cast<std::uint32_t>(mesh_.vertices.size());
        mesh_.vertices.push_back(Vec3f(mesh_.vertices[vertex]));
        mesh_.normals.push_back(normal);
        if (!mesh_.uvs.empty()) mesh_.uvs.push_back(std::array(mesh_.uvs[vertex]));
        copies_.push_back({vertex, copy});
        vertex = copy;
    }

    static constexpr char lacks = 1, filled = 2; ///< of `lacking`; 0: the file's own

private:
    struct Copy {
        std::uint32_t of, copy;
    };
    TriangleMesh& mesh_;
    std::vector<char>& lacking_;
    std::vector<Copy> copies_; ///< at the current point
};

/// Normalizes the good normals of a mesh and says which vertices lack one. Returns whether any does.
bool find_lacking(TriangleMesh& mesh, std::vector<char>& lacking) {
    mesh.normals.resize(mesh.vertices.size(), Vec3f{});
    lacking.assign(mesh.vertices.size(), 0);
    bool any = false;
    for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
        const Vec3 n = to_double(mesh.normals[i]);
        const bool good = is_finite(n) && length_squared(n) > 0;
        mesh.normals[i] = good ? to_float(normalized(n)) : Vec3f{0, 0, 1}; // which no facet may use
        lacking[i] = good ? 0 : Splitter::lacks;
        any = any || !good;
    }
    return any;
}

} // namespace

void complete_normals(TriangleMesh& mesh, double max_angle_deg) {
    std::vector<char> lacking;
    if (!find_lacking(mesh, lacking)) return;
    std::uint32_t count = 0;
    const std::vector<std::uint32_t> points = number_distinct(
        mesh.vertices.size(), count,
        [&](std::size_t i) {
            return hash_floats({mesh.vertices[i].x, mesh.vertices[i].y, mesh.vertices[i].z});
        },
        [&](std::size_t i, std::size_t j) { return is_same(mesh.vertices[i], mesh.vertices[j]); });
    const CornerLists lists(mesh, points, count);
    std::vector<FacetCorner> facets;
    std::vector<Vec3f> normals;
    Splitter splitter(mesh, lacking);
    for (std::size_t p = 0; p < count; ++p) {
        const std::span<const std::uint32_t> corners = lists.at(p);
        const auto vertex = [&](std::uint32_t c) { return mesh.triangles[c / 3][c % 3]; };
        if (std::none_of(corners.begin(), corners.end(), [&](auto c) { return lacking[vertex(c)] != 0; }))
            continue;
        facets.clear();
        for (const std::uint32_t c : corners)
            facets.push_back(facet_corner(mesh, mesh.triangles[c / 3], c % 3));
        crease_normals(facets, max_angle_deg, normals);
        splitter.next_point();
        for (std::size_t i = 0; i < corners.size(); ++i)
            if (lacking[vertex(corners[i])] != 0) splitter.set(corners[i], normals[i]);
    }
}

} // namespace obscura::renderer
