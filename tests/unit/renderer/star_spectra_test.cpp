// SPDX-License-Identifier: Apache-2.0
// Irradiances of stars by class and B-V against published photometry and, where it is, a stellar library.
#include "core/error.hpp"
#include "core/solar_spectrum.hpp"
#include "renderer/lights/star_spectra.hpp"
#include "renderer/scene/star_catalogue.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/data.hpp"
#include "tests/support/temp_folder.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <fstream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace star_spectra_test {

using namespace obscura;
using namespace obscura::renderer;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

/// A passband from its values every `step_nm`.
SpectralBand passband(double from_nm, double step_nm, const std::vector<double>& values) {
    SpectralBand band{from_nm * 1e-9, (from_nm + step_nm * static_cast<double>(values.size() - 1)) * 1e-9};
    for (std::size_t i = 0; i < values.size(); ++i)
        band.transmission.push_back({(from_nm + step_nm * static_cast<double>(i)) * 1e-9, values[i]});
    return band;
}

// Bessell, UBVRI passbands, PASP 102, 1181 (1990), table 2.
const SpectralBand band_b = passband(360, 10, {0,   .03,  .134, .567, .92,  .978, 1,    .978, .935, .853, .74,
                                               .64, .536, .424, .325, .235, .15,  .095, .043, .009, 0});
const SpectralBand band_v =
    passband(470, 10, {0,    .03,  .163, .458, .78,  .967, 1,    .973, .898, .792, .684, .574,
                       .461, .359, .27,  .197, .135, .081, .045, .025, .017, .013, .009, 0});
const SpectralBand band_r =
    passband(550, 10, {0,    .23, .74,  .91,  .98,  1,    .98, .96,  .93,  .9,   .86,  .81,
                       .78,  .72, .67,  .61,  .56,  .51,  .46, .4,   .35,  .308, .266, .224,
                       .182, .14, .118, .096, .074, .052, .03, .024, .018, .012, .006, 0});
const SpectralBand band_i = passband(700, 10, {0,   .024, .232, .555, .785, .91, .965, .985, .99, .995, 1, 1,
                                               .99, .98,  .95,  .91,  .86,  .75, .56,  .33,  .15, .03,  0});

/// Mean irradiance per wavelength through a passband, W m-2 um-1.
double mean_w_m2_um(const scene::Star& star, const SpectralBand& band) {
    double width_um = 0;
    for (const double w : star_band_weights_um(band))
        width_um += w;
    return star_irradiance_w_m2(star, band) / width_um;
}

/// Colour of a star on the scale on which Vega has 0.
double colour(const scene::Star& star, const SpectralBand& blue, const SpectralBand& red) {
    const scene::Star vega{0, 0, 0.03, 0.0};
    return -2.5 * std::log10(mean_w_m2_um(star, blue) / mean_w_m2_um(star, red) * mean_w_m2_um(vega, red) /
                             mean_w_m2_um(vega, blue));
}

scene::Star typed(std::string_view type) {
    scene::Star star;
    star.type = scene::parse_spectral_type(type);
    REQUIRE(star.type);
    return star;
}

} // namespace

TEST_CASE("Vega has its published irradiance") {
    const scene::Star vega{0, 0, 0.03, 0.0};
    // Bohlin, Gordon, Tremblay, PASP 126, 711 (2014): 3.44e-9 erg s-1 cm-2 A-1 at 555.6 nm.
    CHECK_THAT(star_irradiance_w_m2(vega, {550.6e-9, 560.6e-9}) / 0.01, WithinRel(3.44e-8, 0.01));
    // Hayes, Proc. IAU Symp. 111, 225 (1985) and Hayes and Latham, ApJ 197, 593 (1975): AB magnitudes between
    // the lines. Means of 10 nm.
    for (const auto& [nm, magnitude] : std::initializer_list<std::pair<double, double>>{{425.5, -0.219},
                                                                                        {456.6, -0.155},
                                                                                        {500.0, -0.059},
                                                                                        {526.3, -0.006},
                                                                                        {584.0, 0.106},
                                                                                        {643.6, 0.211},
                                                                                        {679.0, 0.261},
                                                                                        {710.0, 0.316},
                                                                                        {755.0, 0.405},
                                                                                        {778.0, 0.442},
                                                                                        {809.0, 0.473}}) {
        INFO(nm << " nm");
        const double expected = 3.44e-8 * std::pow(10, -0.4 * (magnitude - 0.044)) * std::pow(555.6 / nm, 2);
        const double found = star_irradiance_w_m2(vega, {(nm - 5) * 1e-9, (nm + 5) * 1e-9}) / 0.01;
        CHECK_THAT(found, WithinRel(expected, nm < 480 ? 0.02 : 0.01));
    }
    // Bessell, Castelli, Plez, A&A 333, 231 (1998), table A2: irradiances for magnitude 0 in units of
    // 1e-11 erg s-1 cm-2 A-1. Vega is as bright in all four: only ratios are compared.
    const double v = mean_w_m2_um(vega, band_v);
    CHECK_THAT(mean_w_m2_um(vega, band_b) / v, WithinRel(632.0 / 363.1, 0.01));
    CHECK_THAT(mean_w_m2_um(vega, band_r) / v, WithinRel(217.7 / 363.1, 0.01));
    CHECK_THAT(mean_w_m2_um(vega, band_i) / v, WithinRel(112.6 / 363.1, 0.015));
}

TEST_CASE("The Sun as a star has the spectrum of the Sun") {
    // V -26.76 (Willmer, ApJS 236, 47 (2018)), B-V 0.653 (Ramirez et al., ApJ 752, 5 (2012)). The library's
    // G2V has 4 % more light than the Sun beyond 700 nm.
    const scene::Star sun{0, 0, -26.76, 0.653};
    for (int nm = 400; nm < 900; nm += 100) {
        INFO("from " << nm << " nm");
        const SpectralBand band{nm * 1e-9, (nm + 100) * 1e-9};
        CHECK_THAT(star_irradiance_w_m2(sun, band),
                   WithinRel(solar_band_irradiance_w_m2(band.from_m, band.to_m), 0.055));
    }
}

TEST_CASE("Stars have the B-V that they are given") {
    for (const double b_v : {-0.3, -0.1, 0.0, 0.1, 0.3, 0.5, 0.65, 0.8, 1.0, 1.2, 1.4, 1.55}) {
        INFO("B-V " << b_v);
        CHECK_THAT(colour({0, 0, 0, b_v}, band_b, band_v), WithinAbs(b_v, 0.02));
        CHECK_THAT(mean_w_m2_um({0, 0, 5, b_v}, band_v), WithinRel(0.01 * star_v_zero_w_m2_um, 2e-3));
    }
}

TEST_CASE("Stars have the V-I of their class") {
    // Cousins. The Sun: Ramirez et al., ApJ 752, 5 (2012); giants: medians of the Hipparcos catalogue (ESA
    // 1997), fields H37, H40 and H76. M stars go by the type, and the library's M3III has 0.10 less.
    struct Row {
        const char* type = nullptr;
        std::optional<double> b_v;
        double v_i = 0;
        double allowed = 0;
    };
    for (const auto& [type, b_v, v_i, allowed] : std::initializer_list<Row>{{"G2V", {}, 0.70, 0.07},
                                                                            {"K0III", 1.030, 1.00, 0.02},
                                                                            {"K3III", 1.352, 1.32, 0.02},
                                                                            {"K5III", 1.529, 1.57, 0.02},
                                                                            {"M0III", {}, 1.72, 0.07},
                                                                            {"M3III", {}, 2.28, 0.12},
                                                                            {"M5III", {}, 2.94, 0.07},
                                                                            {"M5V", {}, 2.94, 0.07}}) {
        INFO(type);
        scene::Star star = typed(type);
        star.colour_b_v = b_v;
        CHECK_THAT(colour(star, band_v, band_i), WithinAbs(v_i, allowed));
    }
    // B-V does not order the M stars: the type does.
    scene::Star late = typed("M5 III");
    late.colour_b_v = 1.59;
    CHECK_THAT(colour(late, band_v, band_i), WithinAbs(2.94, 0.05));
    // A red star of unknown type is a giant, which has no more infrared light for its B-V than a dwarf.
    CHECK_THAT(colour({0, 0, 0, 1.45}, band_v, band_i), WithinAbs(1.46, 0.05));
}

TEST_CASE("Stars of the classes of the Pickles library have its spectra") {
    for (const char* const type : {"O5V", "B0V", "B3V", "B8V", "A0V", "A5V", "F0V", "F5V", "G0V", "G2V",
                                   "G5V", "G8III", "B0I", "F0I", "G2I"}) {
        std::string name(type);
        std::transform(name.begin(), name.end(), name.begin(),
                       [](char c) { return static_cast<char>(std::tolower(c)); });
        const auto file = test::data_file("spectra/pickles/" + name + ".sed.ext");
        if (!file) continue;
        std::vector<std::pair<double, double>> spectrum; // nm, relative
        std::ifstream in(*file);
        for (double angstrom = 0, flux = 0; in >> angstrom >> flux;)
            spectrum.emplace_back(angstrom / 10, flux);
        REQUIRE(spectrum.size() > 1000);
        // Points every 0.5 nm: their sum is the integral.
        const auto integral = [&](const SpectralBand& band) {
            double sum = 0;
            for (const auto& [nm, flux] : spectrum)
                if (nm * 1e-9 >= band.from_m && nm * 1e-9 < band.to_m) {
                    double weight = 1;
                    if (!band.transmission.empty()) {
                        const double at = (nm * 1e-9 - band.from_m) / 10e-9;
                        const auto i = static_cast<std::size_t>(at);
                        const double share = at - static_cast<double>(i);
                        weight =
                            band.transmission[i].value * (1 - share) +
                            band.transmission[std::min(i + 1, band.transmission.size() - 1)].value * share;
                    }
                    sum += weight * flux;
                }
            return sum;
        };
        scene::Star star = typed(type);
        // By the type alone, and by the class and the B-V of the spectrum.
        for (const bool with_colour : {false, true}) {
            if (with_colour)
                for (const StarTemplate& t : star_templates())
                    if (t.number == star.type->number && t.luminosity == star.type->luminosity)
                        star.colour_b_v = t.colour_b_v;
            const double v = star_irradiance_w_m2(star, band_v) / integral(band_v);
            for (int nm = 400; nm < 900; nm += 100) {
                INFO(type << " from " << nm << " nm" << (with_colour ? ", with B-V" : ""));
                const SpectralBand band{nm * 1e-9, (nm + 100) * 1e-9};
                CHECK_THAT(star_irradiance_w_m2(star, band) / v, WithinRel(integral(band), 0.03));
            }
        }
    }
}

TEST_CASE("Stars of the classes K and M have the bands of the Pickles library") {
    // Files k0v, k2v and so on of the library (Pickles, PASP 110, 863 (1998)), in steps of 5 Angstrom, every
    // other value from the first bin on: means up to 500 nm and from 500, 600, 700 and 800 nm on over the
    // mean through V. Titanium oxide takes a third of M5III between 600 and 700.
    struct Row {
        const char* type;
        double from_nm;
        std::array<double, 5> bands;
    };
    for (const auto& [type, first_nm, bands] :
         std::initializer_list<Row>{{"K0V", 410, {0.9454, 1.003, 0.9474, 0.8104, 0.6609}},
                                    {"K2V", 400, {0.8281, 1.004, 1.01, 0.8767, 0.7402}},
                                    {"K3V", 420, {0.8908, 1.003, 1.079, 0.9868, 0.8509}},
                                    {"K5V", 410, {0.6944, 1.004, 1.236, 1.22, 1.088}},
                                    {"M0V", 420, {0.6614, 0.9998, 1.346, 1.58, 1.608}},
                                    {"M2V", 420, {0.5779, 0.9854, 1.438, 2.001, 2.241}},
                                    {"K0III", 440, {0.9391, 1.003, 0.9944, 0.8851, 0.7454}},
                                    {"K1III", 420, {0.8202, 1.005, 1.03, 0.9295, 0.8106}},
                                    {"K2III", 420, {0.7771, 1.004, 1.075, 1.001, 0.8853}},
                                    {"K3III", 410, {0.6914, 1.003, 1.112, 1.041, 0.9122}},
                                    {"K4III", 420, {0.614, 1.005, 1.195, 1.172, 1.119}},
                                    {"K5III", 450, {0.746, 1.001, 1.267, 1.386, 1.361}},
                                    {"M0III", 400, {0.5416, 1, 1.278, 1.496, 1.531}},
                                    {"M1III", 410, {0.5683, 0.9976, 1.293, 1.614, 1.721}},
                                    {"M2III", 450, {0.692, 0.992, 1.348, 1.763, 1.933}},
                                    {"M3III", 400, {0.5299, 0.9858, 1.344, 2.055, 2.46}},
                                    {"M4III", 410, {0.5616, 0.9765, 1.373, 2.572, 3.493}},
                                    {"M5III", 450, {0.645, 0.965, 1.415, 3.407, 5.347}}}) {
        const scene::Star star = typed(type);
        const double v = mean_w_m2_um(star, band_v);
        for (std::size_t i = 0; i < bands.size(); ++i) {
            const double from_nm = i == 0 ? first_nm : 400 + 100 * static_cast<double>(i);
            const double to_nm = 500 + 100 * static_cast<double>(i);
            INFO(type << " from " << from_nm << " nm");
            CHECK_THAT(mean_w_m2_um(star, {from_nm * 1e-9, to_nm * 1e-9}) / v, WithinRel(bands[i], 0.03));
        }
    }
}

TEST_CASE("A black body has the colour temperature and the V magnitude") {
    scene::Star star{0, 0, 3, 0.65};
    star.spectrum = scene::StarSpectrum::black_body;
    CHECK_THAT(mean_w_m2_um(star, band_v), WithinRel(std::pow(10, -1.2) * star_v_zero_w_m2_um, 1e-3));
    // Ballesteros 2012: the Sun (B-V 0.653) 5770 K within some tens of kelvin; Vega (0) 10,100 K.
    CHECK_THAT(colour_temperature_k(0.653), WithinAbs(5770, 60));
    CHECK_THAT(colour_temperature_k(0), WithinAbs(10125, 10));
    // Planck's law of the colour temperature.
    const auto planck = [](double m, double k) {
        return std::pow(m, -5) / std::expm1(1.438776877e-2 / (m * k));
    };
    const double k = colour_temperature_k(0.65);
    CHECK_THAT(star_irradiance_w_m2(star, {800e-9, 810e-9}) / star_irradiance_w_m2(star, {450e-9, 460e-9}),
               WithinRel(planck(805e-9, k) / planck(455e-9, k), 1e-3));
}

TEST_CASE("A filter weighs a star's light by its curve") {
    const scene::Star star{0, 0, 1, 0.6};
    // Between the bins of the table and inside one of them.
    const SpectralBand ramp = passband(543, 4, {0.2, 0.8});
    CHECK_THAT(star_irradiance_w_m2(star, ramp),
               WithinRel(star_irradiance_w_m2(star, {543e-9, 547e-9}) / 2, 1e-9));
    const SpectralBand window = passband(590, 20, {1, 1, 1});
    CHECK_THAT(star_irradiance_w_m2(star, window),
               WithinRel(star_irradiance_w_m2(star, {590e-9, 630e-9}), 1e-12));
    // Beyond the table light falls with the fourth power.
    CHECK_THAT(star_irradiance_w_m2(star, {4e-6, 4.1e-6}) / star_irradiance_w_m2(star, {3e-6, 3.1e-6}),
               WithinRel(std::pow(3.05 / 4.05, 4), 0.01));
}

TEST_CASE("Spectral types are read as catalogues write them") {
    using enum scene::SpectralType::Luminosity;
    const auto check = [](std::string_view text, double number, scene::SpectralType::Luminosity luminosity) {
        INFO(text);
        const auto type = scene::parse_spectral_type(text);
        REQUIRE(type);
        CHECK_THAT(type->number, WithinAbs(number, 1e-12));
        CHECK(type->luminosity == luminosity);
    };
    check("O9.5V", 0.95, dwarf);
    check("G2V", 4.2, dwarf);
    check("F6IV-V", 3.6, dwarf);
    check("K0 III-IV", 5.0, giant);
    check("K2II", 5.2, giant);
    check("M2Iab", 6.2, supergiant);
    check("B9p Hg Mn", 1.9, unknown);
    check("M", 6.5, unknown);
    for (const char* const other : {"", "C5,3", "S5/4.5e", "WC8", "DA", "sdB", "?"})
        CHECK(!scene::parse_spectral_type(other));
}

TEST_CASE("A catalogue may lack B-V and spectral types") {
    const test::TempFolder folder;
    const auto read = [&](const std::string& text) {
        return scene::read_stars(folder.write("s.csv", text), 99);
    };
    const auto plain = read("ra_deg,dec_deg,v_mag\n1,2,3\n");
    REQUIRE(plain.size() == 1);
    CHECK(!plain[0].colour_b_v);
    CHECK(!plain[0].type);
    const auto coloured = read("ra_deg,dec_deg,v_mag,b_v\n1,2,3,0.5\n1,2,4,\n");
    CHECK(coloured.at(0).colour_b_v == 0.5);
    CHECK(!coloured.at(1).colour_b_v);
    const auto typed_only = read("ra_deg,dec_deg,v_mag,spectral_type\n1,2,3,K5III\n");
    REQUIRE(typed_only.at(0).type);
    CHECK(typed_only[0].type->luminosity == scene::SpectralType::Luminosity::giant);
    const auto both = read("ra_deg, dec_deg, v_mag, b_v, spectral_type\n1,2,3,,M5 III\n1,2,3,1.5,\n");
    REQUIRE(both.at(0).type);
    CHECK_THAT(both[0].type->number, WithinAbs(6.5, 1e-12));
    CHECK(!both[0].colour_b_v);
    CHECK(both.at(1).colour_b_v == 1.5);
    // A parallax gives the class: eps Ind (K5V, B-V 1.06) and Arcturus (K1.5III, 1.24); a text has
    // precedence.
    using enum scene::SpectralType::Luminosity;
    const auto classed = read("ra_deg,dec_deg,v_mag,b_v,spectral_type,parallax_mas\n1,2,4.69,1.06,K5,275.8\n"
                              "1,2,-0.05,1.24,K2,88.8\n1,2,4.69,1.06,,275.8\n1,2,4.69,1.06,K5III,275.8\n"
                              "1,2,4.69,1.06,K5,\n");
    CHECK(classed.at(0).type->luminosity == dwarf);
    CHECK(classed.at(1).type->luminosity == giant);
    CHECK(classed.at(2).type->luminosity == dwarf);
    CHECK(classed.at(3).type->luminosity == giant);
    CHECK(classed.at(4).type->luminosity == unknown);
    // With B-V the spectrum of the class, whether the subclass is known or not.
    CHECK(star_mix(classed[0]).first == star_mix(classed[2]).first);
    CHECK(star_mix(classed[0]).first != star_mix(classed[4]).first);
    CHECK_THROWS_AS(read("ra_deg,dec_deg,v_mag,spectral_type,b_v\n1,2,3,K,0\n"), ConfigError);
    CHECK_THROWS_AS(read("ra_deg,dec_deg,b_v\n1,2,3\n"), ConfigError);
    CHECK_THROWS_AS(read("ra_deg,dec_deg,v_mag,b_v\n1,2,3,red\n"), ConfigError);
}

} // namespace star_spectra_test
