// SPDX-License-Identifier: Apache-2.0
// Procedural small body: an icosphere displaced by noise and craters.
#pragma once

#include "renderer/mesh_files/triangle_mesh.hpp"
#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/shapes/shape_context.hpp"

namespace obscura::renderer {

/// Parameters of make_procedural_body().
struct ProceduralBodyParameters {
    static constexpr std::string_view kind = "procedural";
    static constexpr std::string_view help = "Small body made from noise and craters.";
    using Family = scene::ShapeFamily;

    double mean_radius_m = 500;
    Vec3 axis_ratios{1, 0.8, 0.7};
    std::uint64_t seed = 1;         ///< same seed, same body
    std::uint32_t subdivisions = 6; ///< 20 * 4^n facets
};
[[nodiscard]] scene::ParameterList declare(ProceduralBodyParameters& p);
[[nodiscard]] std::shared_ptr<const Shape> make(const ProceduralBodyParameters& p, ShapeContext& context);

/// An icosphere scaled to the axis ratios, with a lumpy low-frequency shape, fractal relief down to the
/// facet size, craters with rims and worn floors (diameters after a power law), and boulders' roughness. Uses
/// only IEEE operations on hashed integers: the same description gives the same bytes everywhere. Has smooth
/// normals. Crater profile: depth/diameter 0.15, rim height 0.03 diameters, as on small asteroids
/// (Noguchi et al., Crater depth-to-diameter ratios on asteroid 162173 Ryugu, Icarus 354, 2021).
/// Throws ConfigError when a parameter is out of its range.
[[nodiscard]] TriangleMesh make_procedural_body(const ProceduralBodyParameters& description);

/// The unit icosphere of 20 * 4^subdivisions facets, without normals.
[[nodiscard]] TriangleMesh make_icosphere(std::uint32_t subdivisions);

} // namespace obscura::renderer
