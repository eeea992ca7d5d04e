// SPDX-License-Identifier: Apache-2.0
// Area sampler: points uniform over the area of triangles, for bodies that emit light.
#pragma once

#include "core/geometry.hpp"
#include "renderer/shapes/triangle_corners.hpp"

#include <cstddef>
#include <span>
#include <vector>

namespace obscura::renderer {

/// Samples triangles in proportion to their areas. Two successive triangles that make a parallelogram are
/// sampled as one, which keeps stratified samples stratified over it. Immutable; thread-safe.
class AreaSampler {
public:
    AreaSampler() = default;
    explicit AreaSampler(std::span<const TriangleCorners> triangles);

    /// 0: no triangles.
    [[nodiscard]] double area_m2() const { return patches_.empty() ? 0 : patches_.back().sum_m2; }
    /// Point and outer unit normal from u, v in [0,1).
    void sample(double u, double v, Vec3& position, Vec3& normal) const;
    [[nodiscard]] std::size_t bytes() const { return patches_.capacity() * sizeof(Patch); }

private:
    struct Patch {
        Vec3 corner, first, second, normal; ///< corner and edges from it
        double sum_m2 = 0;                  ///< cumulative area, this patch included
        bool parallelogram = false;
    };
    std::vector<Patch> patches_;
};

} // namespace obscura::renderer
