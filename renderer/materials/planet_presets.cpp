// SPDX-License-Identifier: Apache-2.0
#include "renderer/materials/planet_presets.hpp"

#include "renderer/materials/phase_curve.hpp"

namespace obscura::renderer {
namespace {

/// Johnson's U, B, V, R and I at their effective wavelengths (Johnson, ARA&A 4, 193 (1966)), from geometric
/// albedos or colours relative to V.
std::vector<SpectralPoint> johnson(double u, double b, double v, double r, double i) {
    return {{360e-9, u / v}, {440e-9, b / v}, {550e-9, 1}, {700e-9, r / v}, {900e-9, i / v}};
}

} // namespace

// Planets. Albedos, also those of the colours: Mallama, Krobusek, Pavlov, Comprehensive wide-band magnitudes
// and albedos for the planets, Icarus 282, 19 (2017), table 7, Johnson's U, B, V, R, I. Phase curves: Mallama
// and Hilton, Computing apparent planetary magnitudes for The Astronomical Almanac, Astronomy and Computing
// 25, 10 (2018), tabulated to 0.001 mag, unless another source is given. Albedos are for discs of the bodies'
// radii in the IAU report (Archinal et al. 2018), Jupiter and Saturn seen from above the equator. Colours are
// those near opposition at every phase.
//
// Phase integral q and spherical albedo A at the end of each comment belong to the preset; those of Venus,
// Jupiter and Saturn count the light up to the last angle of the table and, beyond, what the law makes of it.
// The limb darkening is typical rather than measured: lunar for Mercury, half and half for Mars (as McEwen
// 1991 at small phase angles), nearly Lambert's for atmospheres.
// tests/unit/renderer/planet_magnitudes_test.cpp holds the magnitudes.

/// To 170 degrees. q 0.480, A 0.068.
scene::Material mercury() {
    return PhaseCurveParameters{
        0.142,
        {0, 2, 5, 10, 15, 20, 30, 40, 50, 60, 70, 80, 90, 100, 110, 120, 130, 140, 150, 160, 165, 170},
        {0,     0.12,  0.28,  0.5,  0.679, 0.832, 1.098, 1.354, 1.624, 1.914, 2.22,
         2.538, 2.871, 3.231, 3.64, 4.132, 4.751, 5.542, 6.547, 7.795, 8.514, 9.292},
        1};
}
std::vector<SpectralPoint> mercury_curve() {
    return johnson(0.087, 0.105, 0.142, 0.172, 0.208);
}

/// To 179 degrees; from 160 on the light is that of a haze that scatters forwards. q 1.35, A 0.93.
scene::Material venus() {
    return PhaseCurveParameters{0.689,
                                {0,   1.5, 10,  20,  30,  40,  50,    60,  70,  80,  90,  100,
                                 110, 120, 130, 140, 150, 160, 163.7, 165, 167, 170, 174, 179},
                                {0,     -0.001, 0.024, 0.106, 0.232, 0.391, 0.574, 0.773,
                                 0.983, 1.201,  1.428, 1.662, 1.91,  2.175, 2.466, 2.792,
                                 3.167, 3.603,  3.791, 3.711, 3.644, 3.669, 3.938, 4.651},
                                0.2};
}
std::vector<SpectralPoint> venus_curve() {
    return johnson(0.348, 0.658, 0.689, 0.708, 0.584);
}

/// The Earth from afar, land, sea and clouds as one. Phase curve: Mallama et al. 2017, table A-3.1 (45, 90,
/// 135 degrees). The formula of Mallama and Hilton 2018 is 0.5 to 0.8 mag brighter at 45 and 90 degrees and
/// would return 57 % of the light; CERES measures a Bond albedo of 0.29. q 0.757, A 0.33.
scene::Material earth() {
    return PhaseCurveParameters{0.434, {0, 45, 90, 135}, {0, 1.123, 2.069, 3.801}, 0.2};
}
std::vector<SpectralPoint> earth_curve() {
    return johnson(0.688, 0.512, 0.434, 0.418, 0.430);
}

/// To 120 degrees, mean over longitude and season, which change it by 0.06 mag each. q 1.02, A 0.173.
scene::Material mars() {
    return PhaseCurveParameters{
        0.170,
        {0, 5, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100, 110, 120},
        {0, 0.11, 0.214, 0.401, 0.563, 0.698, 0.808, 0.93, 1.121, 1.38, 1.709, 2.106, 2.572, 3.107},
        0.5};
}
std::vector<SpectralPoint> mars_curve() {
    return johnson(0.060, 0.088, 0.170, 0.288, 0.330);
}

/// To 130 degrees (from 12 on Cassini: Mayorga et al., AJ 152, 209 (2016)). q 1.31, A 0.71.
scene::Material jupiter() {
    return PhaseCurveParameters{0.538,
                                {0, 2, 5, 10, 12, 15, 20, 30, 40, 50, 60, 70, 80, 90, 100, 110, 120, 130},
                                {0, 0.002, 0.014, 0.058, 0.084, 0.116, 0.171, 0.293, 0.431, 0.586, 0.759,
                                 0.954, 1.17, 1.409, 1.67, 1.948, 2.238, 2.528},
                                0.2};
}
std::vector<SpectralPoint> jupiter_curve() {
    return johnson(0.358, 0.443, 0.538, 0.495, 0.321);
}

/// The globe without its rings, to 150 degrees (from 6.5 on Pioneer 11: Dyudina et al., ApJ 618, 973 (2005)).
/// q 1.36, A 0.68.
scene::Material saturn() {
    return PhaseCurveParameters{
        0.499,
        {0, 2, 4, 6.5, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100, 110, 120, 130, 140, 150},
        {0, 0.002, 0.008, 0.024, 0.038, 0.11, 0.221, 0.363, 0.532, 0.723, 0.934, 1.164, 1.411, 1.677, 1.963,
         2.273, 2.61, 2.98, 3.389},
        0.2};
}
std::vector<SpectralPoint> saturn_curve() {
    return johnson(0.203, 0.339, 0.499, 0.568, 0.423);
}

// Galilean satellites, the mean of leading and trailing side, which differ by 0.05 mag (Ganymede) to 0.3 mag
// (Europa). Albedos: such that V at mean opposition is that of the Astronomical Almanac (section F; Morrison
// and Morrison, in Planetary Satellites, 1977): V(1,0) -1.68, -1.41, -2.09, -1.05 with radii of 1821.6,
// 1560.8, 2631.2 and 2410.3 km. Phase curves to 12 degrees: quadratic formulas quoted by Harris, in Planets
// and Satellites (1961), after Stebbins and Jacobsen; V = 0.046 g - 0.0010 g^2, 0.0312 g - 0.00125 g^2,
// 0.0323 g - 0.00066 g^2, 0.078 g - 0.00274 g^2. Beyond, where Voyager's curves are not at hand: the law's
// own disc function times a magnitude that is linear in the angle, its slope such that the phase integral is
// that of the comment. Colours: U-B and B-V of the same table less the Sun's (0.17, 0.65); at 700 and 860 nm
// the spectra of the USGS archive of planets and satellites (Io and Europa: trailing side, Ganymede and
// Callisto: leading side). The papers of 1961 and 1977 are cited from later ones.

/// q 0.80, typical rather than measured (A 0.50; the bolometric albedo is about 0.52).
scene::Material io() {
    return PhaseCurveParameters{0.63,
                                {0, 2, 4, 6, 9, 12, 20, 30, 40, 50, 60, 70, 80, 90, 100, 110, 120, 130, 140},
                                {0, 0.088, 0.168, 0.24, 0.333, 0.408, 0.52, 0.681, 0.863, 1.065, 1.287, 1.531,
                                 1.799, 2.093, 2.42, 2.786, 3.2, 3.68, 4.252},
                                0.8};
}
std::vector<SpectralPoint> io_curve() {
    return {{360e-9, 0.22}, {440e-9, 0.62}, {550e-9, 1}, {700e-9, 1.27}, {860e-9, 1.25}};
}

/// q 1.09: Buratti and Veverka, Voyager photometry of Europa, Icarus 55, 93 (1983), who also give the share
/// of lunar and Lambert scattering. The spike within 1 degree of opposition is not part of it. A 0.73.
scene::Material europa() {
    return PhaseCurveParameters{0.67,
                                {0, 2, 4, 6, 9, 12, 20, 30, 40, 50, 60, 70, 80, 90, 100, 110, 120, 130, 140},
                                {0, 0.057, 0.105, 0.142, 0.18, 0.194, 0.283, 0.415, 0.568, 0.743, 0.938,
                                 1.157, 1.4, 1.671, 1.975, 2.319, 2.713, 3.174, 3.727},
                                0.7};
}
std::vector<SpectralPoint> europa_curve() {
    return {{360e-9, 0.59}, {440e-9, 0.82}, {550e-9, 1}, {700e-9, 1.19}, {860e-9, 1.26}};
}

/// q 0.8: Squyres and Veverka, Voyager photometry of surface features on Ganymede and Callisto, Icarus 46,
/// 137 (1981), and Icarus 52, 117 (1982). A 0.352.
scene::Material ganymede() {
    return PhaseCurveParameters{0.44,
                                {0, 2, 4, 6, 9, 12, 20, 30, 40, 50, 60, 70, 80, 90, 100, 110, 120, 130, 140},
                                {0, 0.062, 0.119, 0.17, 0.237, 0.293, 0.427, 0.616, 0.825, 1.052, 1.3, 1.568,
                                 1.859, 2.177, 2.525, 2.911, 3.346, 3.845, 4.435},
                                0.9};
}
std::vector<SpectralPoint> ganymede_curve() {
    return {{360e-9, 0.63}, {440e-9, 0.85}, {550e-9, 1}, {700e-9, 1.12}, {860e-9, 1.11}};
}

/// Leading side. q 0.6: as Ganymede. A 0.120.
scene::Material callisto() {
    return PhaseCurveParameters{0.20,
                                {0, 2, 4, 6, 9, 12, 20, 30, 40, 50, 60, 70, 80, 90, 100, 110, 120, 130, 140},
                                {0, 0.145, 0.268, 0.369, 0.48, 0.541, 0.69, 0.895, 1.12, 1.363, 1.625, 1.907,
                                 2.212, 2.541, 2.901, 3.298, 3.743, 4.251, 4.85},
                                1};
}
std::vector<SpectralPoint> callisto_curve() {
    return {{360e-9, 0.58}, {440e-9, 0.82}, {550e-9, 1}, {700e-9, 1.15}, {860e-9, 1.17}};
}

} // namespace obscura::renderer
