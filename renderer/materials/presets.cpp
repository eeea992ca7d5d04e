// SPDX-License-Identifier: Apache-2.0
#include "renderer/materials/presets.hpp"

#include "core/units.hpp"
#include "renderer/materials/ggx.hpp"
#include "renderer/materials/hapke.hpp"
#include "renderer/materials/lambert.hpp"

namespace obscura::renderer {
namespace {

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

// p, q and A at the end of a comment are the geometric albedo, the phase integral and the spherical (Bond)
// albedo of a sphere, integrated from the parameters; surges go on to phase 0.
// tests/unit/renderer/albedos_test.cpp holds them.

/// Disc-integrated, V: fitted so that a sphere is within 5 % both of Kieffer and Stone, The spectral
/// irradiance of the Moon, AJ 129, 2887 (2005), 553.8 nm, from 2 degrees of phase, and of the V magnitudes of
/// Allen's Astrophysical Quantities (0.21 + 0.026 g + 4e-9 g^4), which have no surge, from 4 degrees, both to
/// 120 degrees. The two are 3 to 9 % apart. Parameters for that curve, not of the regolith. p 0.136, q 0.529,
/// A 0.0721.
scene::Material moon() {
    return hapke(0.233, 0.218, 0.585, 1.68, 0.106, 21);
}

/// Disc-resolved, 550 nm: Li, A'Hearn, McFadden, Photometric analysis of Eros from NEAR data, Icarus 172, 415
/// (2004); Li, thesis, University of Maryland (2005): w 0.33, g -0.25, theta 28 deg, B0 1.4, h 0.010,
/// geometric albedo 0.23. p 0.230, q 0.382, A 0.088. w mimics the spectrum from 450 to 1050 nm (MSI, seven
/// wavelengths), g and theta are the same at all of them (abstract of the thesis): w is 0.33 times
/// s_class_curve(), the registry says.
scene::Material eros() {
    return hapke(0.33, 0.25, 1, 1.4, 0.010, 28);
}

/// Disc-resolved near infrared: Kitazato et al., Near-infrared spectrophotometry of Asteroid 25143 Itokawa
/// from NIRS on the Hayabusa spacecraft, Icarus 194, 137 (2008): B0 0.87, h 0.01, g -0.35, theta 26 deg. w is
/// theirs at 1.57 um, 0.42, lowered to 0.35 so that the geometric albedo is the 0.27 that Tatsumi et al.,
/// Icarus 311, 175 (2018), give in V. p 0.273, q 0.385, A 0.105.
scene::Material itokawa() {
    return hapke(0.35, 0.35, 1, 0.87, 0.01, 26);
}

/// Disc-averaged, 649 nm: Fornasier et al., Spectrophotometric properties of the nucleus of comet
/// 67P/Churyumov-Gerasimenko from the OSIRIS instrument, A&A 583, A30 (2015): w 0.042, g -0.37, B0 2.5,
/// h 0.079, theta 15 deg, geometric albedo 0.065. p 0.0636, q 0.283, A 0.0180.
scene::Material comet_67p() {
    return hapke(0.042, 0.37, 1, 2.5, 0.079, 15);
}

/// Aluminised Kapton, Kapton outside: solar absorptance 0.40 (Fortescue, Swinerd, Stark, Spacecraft Systems
/// Engineering, 4th ed., 2011, table 11.3). Its wrinkles as a roughness are typical, not measured.
/// Reflectance at normal incidence 0.589 (0.60 less what the law loses between facets), A 0.589.
scene::Material mli() {
    GgxParameters m;
    m.reflectance_f0 = 0.60;
    m.roughness = 0.35;
    return m;
}

/// Gallium arsenide under cover glass: solar absorptance 0.88 (the same table, typical value). 4 % of the
/// light is mirrored by bare glass of index 1.5 (Fresnel); the rest of what is reflected is taken as diffuse.
/// Reflectance at normal incidence 0.114, A 0.148.
scene::Material solar_cell() {
    GgxParameters m;
    m.reflectance_f0 = 0.04;
    m.roughness = 0.1;
    m.base_albedo = 0.08;
    return m;
}

/// Silicate white paint: solar absorptance 0.12 new, 0.14 after 1000 hours of ultraviolet light (the same
/// table). Diffuse: typical. p 0.587, q 1.5, A 0.88.
scene::Material white_paint() {
    return LambertParameters{0.88};
}

/// Mean of the S class: DeMeo, Binzel, Slivan, Bus, An extension of the Bus asteroid taxonomy into the
/// near-infrared, Icarus 202, 160 (2009), to 0.01.
std::vector<SpectralPoint> s_class_curve() {
    return {{450e-9, 0.84}, {500e-9, 0.92},  {550e-9, 1.00}, {600e-9, 1.06}, {650e-9, 1.11},
            {700e-9, 1.14}, {750e-9, 1.16},  {800e-9, 1.14}, {850e-9, 1.10}, {900e-9, 1.07},
            {950e-9, 1.08}, {1000e-9, 1.10}, {1050e-9, 1.12}};
}

} // namespace obscura::renderer
