// SPDX-License-Identifier: Apache-2.0
// Exchange of light between patches: what each of them sees of the others, traced once.
#pragma once

#include "renderer/received/patch_scene.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace obscura::renderer {

/// What a body's patches see: bodies nearby and itself along directions over the hemisphere, weighed by the
/// cosine, bodies far away along directions to their discs. The hits are the view factors.
struct BodyExchange {
    std::uint32_t directions = 0;    ///< of each patch to surfaces nearby; 0: it sees none
    std::vector<std::uint32_t> near; ///< [patch * directions + k]: PatchHit::patch
    /// A far body's patch that is seen, and its share of the irradiance per radiosity.
    struct FarHit {
        std::uint32_t patch;
        float weight;
    };
    std::size_t far_directions = 0;         ///< of each patch to all bodies far away
    std::vector<FarHit> far;                ///< [patch * far_directions + k]
    std::uint64_t rays = 0, inner_hits = 0; ///< inner: on inner sides of facets
};

/// Traces it, `directions` over hemispheres and `far_directions` to each body far away. Calls `done` with the
/// number of packets of patches that are done; false ends it.
[[nodiscard]] BodyExchange trace_exchange(const PatchRays& rays, const PatchBody& body,
                                          std::uint32_t directions, std::uint32_t far_directions,
                                          std::uint64_t seed, const std::function<bool(std::size_t)>& done);

/// Directions of the hits `near` of a packet of patches, body frame: those that trace_exchange() took.
/// `seeds`: Receivers::seeds() of Draw::near.
void near_directions(const Words& seeds, std::uint32_t k, const Vec3s& normal, Vec3s& direction);

} // namespace obscura::renderer
