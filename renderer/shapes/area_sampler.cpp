// SPDX-License-Identifier: Apache-2.0
#include "renderer/shapes/area_sampler.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::renderer {

AreaSampler::AreaSampler(std::span<const TriangleCorners> triangles) {
    double sum_m2 = 0;
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const TriangleCorners& t = triangles[i];
        const Vec3 first = t[1] - t[0];
        const Vec3 diagonal = t[2] - t[0];
        Patch patch{t[0], first, diagonal, normalized(cross(first, diagonal)), 0, false};
        double area_m2 = length(cross(first, diagonal)) / 2;
        if (i + 1 < triangles.size()) {
            // The fan of a quadrilateral face: its second triangle starts with the diagonal.
            const TriangleCorners& next = triangles[i + 1];
            const Vec3 second = next[2] - t[0];
            if (next[0] == t[0] && next[1] == t[2] &&
                length(first + second - diagonal) < 1e-6 * length(diagonal)) {
                patch.second = second;
                patch.parallelogram = true;
                area_m2 *= 2;
                ++i;
            }
        }
        sum_m2 += area_m2;
        patch.sum_m2 = sum_m2;
        patches_.push_back(patch);
    }
}

void AreaSampler::sample(double u, double v, Vec3& position, Vec3& normal) const {
    // Select the patch by u and reuse the remainder of u, which keeps the samples stratified.
    const double at_m2 = u * patches_.back().sum_m2;
    const auto patch = std::upper_bound(patches_.begin(), patches_.end() - 1, at_m2,
                                        [](double at, const Patch& p) { return at < p.sum_m2; });
    const double before_m2 = patch == patches_.begin() ? 0 : (patch - 1)->sum_m2;
    const double rest = std::clamp((at_m2 - before_m2) / (patch->sum_m2 - before_m2), 0.0, 1.0);
    normal = patch->normal;
    if (patch->parallelogram) {
        position = patch->corner + patch->first * rest + patch->second * v;
        return;
    }
    const double root = std::sqrt(rest);
    position = patch->corner + patch->first * (root * (1 - v)) + patch->second * (root * v);
}

} // namespace obscura::renderer
