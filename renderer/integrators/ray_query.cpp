// SPDX-License-Identifier: Apache-2.0
#include "renderer/integrators/ray_query.hpp"

#include "renderer/shapes/single_ray.hpp"
#include "renderer/world/row_state.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace obscura::renderer {

void nearest_distances(const RowState& row, std::span<const Vec3> origins_m, std::span<const Vec3> directions,
                       std::span<double> distances_m) {
    std::vector<Vec3> origins(origins_m.size()), towards(origins_m.size());
    std::vector<double> distances(origins_m.size());
    std::fill(distances_m.begin(), distances_m.end(), no_hit);
    for (const BodyState& body : row.bodies) {
        for (std::size_t i = 0; i < origins.size(); ++i) {
            origins[i] = body.from_inertial * (origins_m[i] - body.seen.position_at(0));
            towards[i] = body.from_inertial *
                         (body.seen.moves() ? normalized(directions[i] + body.seen.beta) : directions[i]);
        }
        distances_along(*body.shape, origins, towards, distances, body.detail_view());
        if (body.seen.moves())
            for (std::size_t i = 0; i < distances.size(); ++i)
                distances[i] /= body.seen.stretch(directions[i]);
        std::transform(distances.begin(), distances.end(), distances_m.begin(), distances_m.begin(),
                       [](double a, double b) { return std::min(a, b); });
    }
}

} // namespace obscura::renderer
