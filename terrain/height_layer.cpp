// SPDX-License-Identifier: Apache-2.0
#include "terrain/height_layer.hpp"

#include <algorithm>

namespace obscura::terrain {

Cap cap_of(const SurfaceDomain& domain, TileKey key) {
    const auto at = [&](int i, int j) {
        return domain.point(key.face, SurfaceDomain::coordinate(key.level, key.i, i),
                            SurfaceDomain::coordinate(key.level, key.j, j));
    };
    Cap cap{at(tile_cells / 2, tile_cells / 2), 0};
    for (const int i : {-1, tile_cells / 2, tile_cells + 1})
        for (const int j : {-1, tile_cells / 2, tile_cells + 1})
            cap.radius_m = std::max(cap.radius_m, length(at(i, j) - cap.centre_m));
    cap.radius_m *= 1 + 1e-3;
    return cap;
}

} // namespace obscura::terrain
