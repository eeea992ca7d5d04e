// SPDX-License-Identifier: Apache-2.0
// Pictures and tables of a scattering law: lobes, phase curve, spheres.
#pragma once

#include "renderer/materials/material.hpp"
#include "tools/pictures/figure.hpp"

#include <string>
#include <string_view>

namespace obscura::tools {

/// SVG document: r in the plane of incidence over the emission angle, for incidences of 0, 30 and 60 degrees,
/// and magnitude of a sphere over the phase angle.
[[nodiscard]] std::string law_svg(const renderer::Material& law, std::string_view title);

/// Spheres of the law at phase angles of 5, 30, 60 and 100 degrees, in radiance factor I/F.
[[nodiscard]] Canvas law_spheres(const renderer::Material& law);

/// CSV with columns incidence_deg, emission_deg, azimuth_deg, phase_deg, r_per_sr: 0 to 85 degrees in steps
/// of 5, azimuths in steps of 30.
[[nodiscard]] std::string law_csv(const renderer::Material& law);

/// Disc-integrated brightness of a sphere of radius 1 at a phase angle: the flux at distance 1 for an
/// irradiance of pi, so that its value at phase 0 is the geometric albedo times pi.
[[nodiscard]] double sphere_brightness(const renderer::Material& law, double phase_deg);

} // namespace obscura::tools
