// SPDX-License-Identifier: Apache-2.0
// Reflectance of ground whose slopes are finer than the surface that rays meet: mean over a Gaussian of
// slopes.
#pragma once

#include "renderer/materials/material.hpp"
#include "renderer/packets/packet.hpp"

namespace obscura::renderer {

/// Bidirectional reflectance for unit vectors in one frame, `view` towards the surface and `light` away from
/// it, lane by lane: that of the material on the surface's normal, or, with `unresolved`
/// (Shape::unresolved_slopes), the mean of that on facets about it as the viewer sees them.
///
/// Slopes are those of an isotropic Gaussian; the mean over them is taken at nine of them (the product of
/// Gauss and Hermite's rule of three), which is exact to the second power of their variance where all facets
/// are lit and seen. Of the facets that are turned to the light, others shade the share that Smith's function
/// has (Smith, Geometrical shadowing of a random rough surface, IEEE Trans. AP 15, 1967; Walter et al.,
/// Microfacet models for refraction, EGSR 2007, eq. 15), less where light and viewer are on one side (van
/// Ginneken et al., Applied Optics 37, 130, 1998). Light between facets is left out.
void ground_reflectance(const Material& material, const SurfacePacket& surface, const Vec3s& view,
                        const Vec3s& light, const ParameterPacket* varied, const Doubles* unresolved,
                        Doubles& r);
/// The same in each of `bands` of a spectral() material.
void ground_reflectances(const Material& material, const SurfacePacket& surface, const Vec3s& view,
                         const Vec3s& light, const ParameterPacket* varied, const Doubles* unresolved,
                         std::size_t bands, Channels& r);

} // namespace obscura::renderer
