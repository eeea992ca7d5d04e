// SPDX-License-Identifier: Apache-2.0
#include "tools/model/new_model.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace obscura::tools {
namespace {

constexpr std::string_view material = R"(// {0}: a scattering law in SuMoL.
//
//   obscura model check {0}.brdf            is it sound?
//   obscura model plot {0}.brdf -o {0}.png  what does a sphere of it look like?
//
// In a scene file, beside it:
//   [[body]]
//   material = {{ model = "{0}.brdf", albedo = 0.2 }}

// A parameter is a key of the scene. Its comment gives unit, range and meaning. With the unit deg the key is called
// spread_deg, and the text sees radians.
parameter albedo 0.1;   //! , 0..1, Albedo of the diffuse part
parameter gloss 0.05;   //! , 0..1, Share of the light in the highlight
parameter spread 8;     //! deg, 0.5..45, Width of the highlight

// Functions stand before their use. All numbers are real: 1 / 2 is 0.5.
scalar gaussian(scalar angle, scalar width)
{{
    scalar x = angle / width;
    return exp(-x * x / 2);
}}

// The BRDF times the cosine of incidence, in 1/sr: Lambert's law is max(0, (i | n)) / pi.
//   i  from the surface towards the light, e towards the camera, n the normal; all of length 1
//   (a | b)  dot product of two vectors
//   diffuse  colours of the body at the point, as its textures give them
vec4 brdf(vec3 $i, vec3 $e, vec3 $n, vec4 diffuse, vec4 specular, scalar shininess)
{{
    scalar mu0 = (i | n);
    if (mu0 <= 0) return vec4(0);
    // Angle between the camera and the mirrored light.
    vec3 mirrored = reflect(-i, n);
    scalar away = acos(clamp((mirrored | e), -1, 1));
    // A narrow lobe holds 2 pi spread^2 of the light of its peak.
    scalar lobe = gaussian(away, spread) / (2 * M_PI * spread * spread);
    return diffuse * (albedo * (1 - gloss) * M_1_PI * mu0 + albedo * gloss * lobe * mu0);
}}
)";

} // namespace

std::string new_model_text(std::string_view kind, std::string_view name) {
    if (kind == "material") return fmt::format(fmt::runtime(material), name);
    throw std::out_of_range(fmt::format("no new model of kind {}", kind));
}

} // namespace obscura::tools
