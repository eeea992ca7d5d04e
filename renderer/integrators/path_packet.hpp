// SPDX-License-Identifier: Apache-2.0
// Packet of 16 light paths: their state, rays in the frame of a body, compaction.
#pragma once

#include "renderer/lights/colour_products.hpp"
#include "renderer/packets/packet.hpp"
#include "renderer/packets/sampler.hpp"
#include "renderer/world/instants.hpp"

#include <cstddef>
#include <cstdint>
#include <span>

namespace obscura::renderer {

/// pdf of directions that area sampling cannot find: the camera's own rays and mirrored ones (a delta
/// distribution). Emission that they meet has MIS weight 1.
constexpr double delta_pdf = no_hit;

/// 16 paths: current ray, throughput and random numbers.
struct PathPacket {
    Vec3s origin;    ///< inertial axes, relative to `start`
    Vec3s direction; ///< inertial axes
    Vec3s start;     ///< position of the body that the path left, when it did, or of the camera; inertial
    Lanes alive;
    Channels throughput;
    Doubles pdf;         ///< of `direction` by BSDF sampling, 1/sr; or delta_pdf
    Doubles expectation; ///< factor on the throughput in Russian roulette, see ElevationGuide
    Doubles travelled_m; ///< path length from the camera
    HitPacket hits;      ///< nearest surfaces along the rays
    /// Body that the path left, if the light of its planetshine sources was sampled there; else -1.
    std::int32_t shone_on[packet_size];
    ColourProducts::Chain chain[packet_size]; ///< surfaces that it has met
    Words index, seed;                        ///< of their random numbers, see SampleStream
    Words instant;                            ///< see Instants
    Doubles level_u;                          ///< see RayPacket
    /// The camera ray that the path began with: packet of the batch times packet_size plus lane.
    std::int32_t owner[packet_size];

    /// Path length from the camera to the hit of a lane.
    [[nodiscard]] double path_m(int lane) const { return travelled_m[lane] + hits.t[lane]; }
};

/// Transforms the rays of `paths` to the frame of body `body`: sets origin, direction and stretch of `rays`.
void to_body_frame(const Instants& instants, std::int32_t body, const PathPacket& paths, RayPacket& rays);

/// Moves the paths that are alive to the front, so that packets stay full, and adds their last ray to
/// `travelled_m`. Returns the number of packets that they fill.
std::size_t compact(std::span<PathPacket> paths, std::size_t channels);

} // namespace obscura::renderer
