// SPDX-License-Identifier: Apache-2.0
// Path vertices on the surfaces of bodies that share a frame: BRDF evaluation and BSDF sampling.
#pragma once

#include "renderer/integrators/path_packet.hpp"
#include "renderer/packets/packet.hpp"
#include "renderer/world/instants.hpp"

#include <cstddef>
#include <cstdint>

namespace obscura::renderer {

/// Path vertices on bodies that share a frame; everything in that frame.
struct PathVertex {
    std::int32_t body = -1;                        ///< any body of the frame
    Lanes here;                                    ///< the lanes that scatter light
    ColourProducts::Chain chain[packet_size] = {}; ///< of each lane's path, this surface included
    std::int32_t of[packet_size];                  ///< index of each lane's body in the row
    std::int32_t bodies[packet_size];              ///< the bodies that were hit, `count` of them
    Lanes on[packet_size];                         ///< the lanes on each of `bodies`
    int count = 0;
    bool coherent = true; ///< reached by camera rays
    RayPacket view;
    SurfacePacket surface;
    Channels colour;                     ///< factor on the material's reflectance
    bool varies[packet_size];            ///< whether the parameters of each of `bodies` differ by lane
    ParameterPacket varied[packet_size]; ///< the parameters of those that do
    bool rougher[packet_size];           ///< whether each of `bodies` has unresolved slopes
    Doubles unresolved;                  ///< those of all: Shape::unresolved_slopes
    std::int32_t slot[packet_size];      ///< index of each lane's body in `bodies`

    /// Material parameters of one lane; null: the material's constants.
    [[nodiscard]] const ParameterPacket* varied_at(int lane) const {
        return varies[slot[lane]] ? &varied[slot[lane]] : nullptr;
    }
};

/// BRDF at the lanes of a vertex: `r` times `colour` in each band.
struct Scattered {
    Doubles r;              ///< 1/sr; 0 only where it is in all bands
    const Channels* colour; ///< PathVertex::colour, or `own`
    Channels own;           ///< with materials whose reflectances differ between bands
};
/// BRDF of each lane's material towards the viewer for light from `light` (unit, the vertex's frame); 0 on
/// mirrors. `out.colour` lives as long as vertex and `out`.
void evaluate_brdf(const RowState& row, const PathVertex& vertex, std::size_t channels, const Vec3s& light,
                   Scattered& out);

/// pdf of sample_bsdf() for the direction `light` (unit, the vertex's frame) of one lane, 1/sr; not of
/// mirrors.
[[nodiscard]] double sample_bsdf_pdf(const RowState& row, const PathVertex& vertex, int lane, Vec3 light);

/// Samples the BSDF: next ray and throughput of `next`, whose paths end where nothing is scattered.
void sample_bsdf(const Instants& instants, const PathVertex& vertex, const Doubles& u, const Doubles& v,
                 std::size_t channels, PathPacket& next);

} // namespace obscura::renderer
