// SPDX-License-Identifier: Apache-2.0
#include "renderer/materials/presets.hpp"

#include "renderer/materials/ggx.hpp"
#include "renderer/materials/hapke.hpp"
#include "renderer/materials/lambert.hpp"

#include <numbers>

namespace obscura::renderer {
namespace {

constexpr double degree = std::numbers::pi / 180;

HapkeParameters hapke(double w, double b, double c, double b0, double h, double roughness_deg) {
    HapkeParameters m;
    m.single_scattering_albedo = w;
    m.phase_b = b;
    m.phase_c = c;
    m.shadow_hiding_b0 = b0;
    m.shadow_hiding_h = h;
    m.roughness_rad = roughness_deg * degree;
    return m;
}

} // namespace

// A one-lobed Henyey-Greenstein function of asymmetry -g is the two-lobed one with b = g, c = 1.

/// Disc-integrated phase curve in V: Helfenstein and Veverka, Photometric properties of lunar terrains
/// derived from Hapke's equation, Icarus 72, 342 (1987): w 0.21, h 0.07, theta 20 deg, S(0) 0.71, phase
/// function 1 + 0.29 cos g + 0.39 P2(cos g). B0 = S(0) / (w p(0)) = 2.01; the two-lobed function with b
/// 0.262, c 0.313 has the same values at 0 and 180 degrees, and at 90 degrees 0.84 for 0.81. Geometric albedo
/// 0.12.
scene::Material moon() {
    return hapke(0.21, 0.262, 0.313, 2.01, 0.07, 20);
}

/// Disc-resolved, 550 nm: Li, A'Hearn, McFadden, Photometric analysis of Eros from NEAR data, Icarus 172, 415
/// (2004); Li, thesis, University of Maryland (2005): w 0.33, g -0.25, theta 28 deg, B0 1.4, h 0.010,
/// geometric albedo 0.23.
scene::Material eros() {
    return hapke(0.33, 0.25, 1, 1.4, 0.010, 28);
}

/// Disc-resolved near infrared: Kitazato et al., Near-infrared spectrophotometry of Asteroid 25143 Itokawa
/// from NIRS on the Hayabusa spacecraft, Icarus 194, 137 (2008): B0 0.87, h 0.01, g -0.35, theta 26 deg. w is
/// theirs at 1.57 um, 0.42, lowered to 0.35 so that the geometric albedo is the 0.27 that Tatsumi et al.,
/// Icarus 311, 175 (2018), give in V.
scene::Material itokawa() {
    return hapke(0.35, 0.35, 1, 0.87, 0.01, 26);
}

/// Disc-averaged, 649 nm: Fornasier et al., Spectrophotometric properties of the nucleus of comet
/// 67P/Churyumov-Gerasimenko from the OSIRIS instrument, A&A 583, A30 (2015): w 0.042, g -0.37, B0 2.5,
/// h 0.079, theta 15 deg, geometric albedo 0.065.
scene::Material comet_67p() {
    return hapke(0.042, 0.37, 1, 2.5, 0.079, 15);
}

/// Aluminised Kapton, Kapton outside: solar absorptance 0.40 (Fortescue, Swinerd, Stark, Spacecraft Systems
/// Engineering, 4th ed., 2011, table 11.3). Its wrinkles as a roughness are typical, not measured.
scene::Material mli() {
    GgxParameters m;
    m.reflectance_f0 = 0.60;
    m.roughness = 0.35;
    return m;
}

/// Gallium arsenide under cover glass: solar absorptance 0.88 (the same table, typical value). 4 % of the
/// light is mirrored by bare glass of index 1.5 (Fresnel); the rest of what is reflected is taken as diffuse.
scene::Material solar_cell() {
    GgxParameters m;
    m.reflectance_f0 = 0.04;
    m.roughness = 0.1;
    m.base_albedo = 0.08;
    return m;
}

/// Silicate white paint: solar absorptance 0.12 new, 0.14 after 1000 hours of ultraviolet light (the same
/// table). Diffuse: typical.
scene::Material white_paint() {
    return LambertParameters{0.88};
}

} // namespace obscura::renderer
