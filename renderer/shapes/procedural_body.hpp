// A small body made from noise and craters.
#pragma once

#include "renderer/scene/scene.hpp"
#include "renderer/shapes/triangle_mesh.hpp"

namespace obscura::renderer {

/// An icosphere drawn out to the axis ratios, with a lumpy low-frequency shape, fractal relief down to the
/// facet size, craters with rims and worn floors (diameters after a power law), and boulders' roughness. Uses
/// only IEEE operations on hashed integers: the same description gives the same bytes everywhere. Has smooth
/// normals. Crater profile: depth/diameter 0.15, rim height 0.03 diameters, as on small asteroids
/// (Noguchi et al., Crater depth-to-diameter ratios on asteroid 162173 Ryugu, Icarus 354, 2021).
/// Throws ConfigError when subdivisions > 9 or a size is not positive and finite.
[[nodiscard]] TriangleMesh make_procedural_body(const scene::ProceduralBody& description);

/// The unit icosphere of 20 * 4^subdivisions facets, without normals.
[[nodiscard]] TriangleMesh make_icosphere(std::uint32_t subdivisions);

} // namespace obscura::renderer
