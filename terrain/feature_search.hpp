// SPDX-License-Identifier: Apache-2.0
// Search for the features of a terrain, craters and boulders, that its layers make: for the truth of frames.
#pragma once

#include "core/geometry.hpp"
#include "terrain/surface_domain.hpp"

#include <cstdint>
#include <memory_resource>

namespace obscura::terrain {

/// What procedural detail puts on a surface, one by one.
enum class FeatureKind : std::uint8_t { crater, boulder };

/// A crater or boulder of procedural detail.
struct SurfaceFeature {
    FeatureKind kind = FeatureKind::crater;
    std::uint64_t id = 0; ///< unique among those of a layer, the same for the same seed
    Vec3 position_m;      ///< of its centre on the reference surface
    double diameter_m = 0;
};

/// Says what is looked for, and takes what is found: HeightLayer::find_features().
class FeatureSearch {
public:
    virtual ~FeatureSearch() = default;
    /// Whether features of up to `largest_m` with centres in a square of the reference surface may be wanted.
    [[nodiscard]] virtual bool wants(TileKey square, double largest_m) = 0;
    /// Whether a feature may be wanted, before it is known whether it is there.
    [[nodiscard]] virtual bool wants(Vec3 position_m, double diameter_m) = 0;
    virtual void add(const SurfaceFeature& feature) = 0;
    /// For what layers need during the search.
    [[nodiscard]] virtual std::pmr::memory_resource& memory() = 0;
};

} // namespace obscura::terrain
