// SPDX-License-Identifier: Apache-2.0
// Albedos and phase curves of spheres by integration: laws against closed forms, named surfaces against their
// stated values, the Moon against published photometry.
#include "core/error.hpp"
#include "renderer/materials/hapke.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/materials/lommel_seeliger.hpp"
#include "renderer/materials/material.hpp"
#include "renderer/materials/minnaert.hpp"
#include "renderer/materials/phase_curve.hpp"
#include "renderer/materials/planet_presets.hpp"
#include "renderer/materials/presets.hpp"
#include "renderer/materials/registry.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "renderer/world/preset_range.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace albedos_test {

using namespace obscura;
using namespace obscura::renderer;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double pi = std::numbers::pi;
constexpr double deg = pi / 180;

/// Points and weights of Gauss-Legendre quadrature on [-1, 1], by Newton's method.
struct Gauss {
    std::vector<double> x, w;
    explicit Gauss(int n) {
        for (int i = 0; i < n; ++i) {
            double z = std::cos(pi * (i + 0.75) / (n + 0.5));
            double slope = 1;
            for (int step = 0; step < 50; ++step) {
                double p = 1;
                double before = 0;
                for (int k = 0; k < n; ++k) {
                    const double next = ((2 * k + 1) * z * p - k * before) / (k + 1);
                    before = p;
                    p = next;
                }
                slope = n * (z * p - before) / (z * z - 1);
                z -= p / slope;
            }
            x.push_back(z);
            w.push_back(2 / ((1 - z * z) * slope * slope));
        }
    }
};

double reflectance(const Material& material, double cos_in, double cos_out, double cos_phase) {
    ScatterPacket s{};
    for (int i = 0; i < packet_size; ++i) {
        s.cos_in[i] = cos_in;
        s.cos_out[i] = cos_out;
        s.cos_phase[i] = cos_phase;
    }
    Doubles r;
    material.reflectance(s, r);
    return r[0];
}

/// Disc-integrated albedo A(g): radiance of a sphere's whole disc over that of a Lambert disc of albedo 1,
/// lit and seen along the normal. Integral over photometric longitude and latitude.
double disc_albedo(const Material& material, double phase) {
    static const Gauss gauss(64);
    double sum = 0;
    for (std::size_t j = 0; j < gauss.x.size(); ++j) {
        const double longitude = (gauss.x[j] + 1) / 2 * (pi - phase) + phase - pi / 2;
        for (std::size_t k = 0; k < gauss.x.size(); ++k) {
            const double latitude = gauss.x[k] * pi / 2;
            const double mu = std::cos(latitude) * std::cos(longitude);
            const double mu0 = std::cos(latitude) * std::cos(longitude - phase);
            sum += gauss.w[j] * (pi - phase) / 2 * gauss.w[k] * pi / 2 * std::cos(latitude) * mu *
                   reflectance(material, mu0, mu, std::cos(phase));
        }
    }
    return sum;
}

/// Phase integral: 2 times the integral of A(g) / A(0) sin g, finer near opposition.
double phase_integral(const Material& material) {
    static const Gauss gauss(24);
    const std::array parts{0.0, 0.05, 0.4, pi};
    double sum = 0;
    for (std::size_t p = 1; p < parts.size(); ++p)
        for (std::size_t i = 0; i < gauss.x.size(); ++i) {
            const double half = (parts[p] - parts[p - 1]) / 2;
            const double g = parts[p - 1] + half * (gauss.x[i] + 1);
            sum += gauss.w[i] * half * disc_albedo(material, g) * std::sin(g);
        }
    return 2 * sum / disc_albedo(material, 0);
}

/// Fraction of the light from a direction that is reflected, by the law's own sampling: highlights are
/// narrow.
double hemispherical(const Material& material, double cos_in) {
    const Vec3 from{std::sqrt(1 - cos_in * cos_in), 0, cos_in};
    double sum = 0;
    constexpr int n = 160;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const Vec3 to = material.sample(from, (i + 0.5) / n, (j + 0.5) / n);
            if (to.z > 0) sum += reflectance(material, to.z, cos_in, dot(from, to)) / material.pdf(from, to);
        }
    return sum / (n * n); // reciprocal: light from `from` leaves as light to `from` came
}

double bond_by_hemispheres(const Material& material) {
    static const Gauss gauss(16);
    double sum = 0;
    for (std::size_t i = 0; i < gauss.x.size(); ++i) {
        const double mu = (gauss.x[i] + 1) / 2;
        sum += gauss.w[i] * mu * hemispherical(material, mu);
    }
    return sum;
}

std::unique_ptr<Material> make(const scene::Material& description) {
    return make_material(description, "test");
}

/// Kieffer and Stone, The spectral irradiance of the Moon, AJ 129, 2887 (2005), eq. 10 and table 4, 553.8 nm,
/// for mean libration and the mean of waxing and waning; measured from 1.55 to 97 degrees.
double rolo_553_nm(double phase_deg) {
    const double g = phase_deg * deg;
    return std::exp(-2.12504 - 1.65970 * g + 0.38409 * g * g - 0.20655 * g * g * g +
                    0.37206 * std::exp(-phase_deg / 4.06054) - 0.10745 * std::exp(-phase_deg / 12.8802) +
                    0.00347 * std::cos((phase_deg + 30.5858) / 16.7498));
}

/// Allen's Astrophysical Quantities: V = 0.21 + 0.026 g + 4e-9 g^4 at unit distances, geometric albedo 0.12.
/// Has no opposition surge.
double allen_v(double phase_deg) {
    return 0.12 * std::pow(10, -0.4 * (0.026 * phase_deg + 4e-9 * std::pow(phase_deg, 4)));
}

scene::Scene scene_with(const std::string& keys) {
    const test::TempFolder folder;
    return scene::load_scene(
        folder.write("s.toml", "[[body]]\nshape = \"ellipsoid\"\nradii_m = [1, 1, 1]\n" + keys));
}

} // namespace

TEST_CASE("Spheres of the simple laws have their closed albedos") {
    const auto lambert = make(LambertParameters{0.6});
    CHECK_THAT(disc_albedo(*lambert, 0), WithinRel(0.4, 1e-6));
    CHECK_THAT(phase_integral(*lambert), WithinRel(1.5, 1e-5));
    CHECK_THAT(bond_by_hemispheres(*lambert), WithinRel(0.6, 1e-6));
    // Russell 1916: w / 8, phase integral 16 (1 - ln 2) / 3.
    const auto seeliger = make(LommelSeeligerParameters{0.4});
    CHECK_THAT(disc_albedo(*seeliger, 0), WithinRel(0.05, 1e-4));
    CHECK_THAT(phase_integral(*seeliger), WithinRel(16 * (1 - std::log(2.0)) / 3, 1e-3));
    // Bond albedo 4 A / (k + 1)^2.
    const auto minnaert = make(MinnaertParameters{0.3, 0.8});
    CHECK_THAT(disc_albedo(*minnaert, 0) * phase_integral(*minnaert), WithinRel(4 * 0.3 / (1.8 * 1.8), 5e-3));
}

TEST_CASE("Named bodies have the albedos and phase integrals that they state") {
    struct Stated {
        const char* name;
        scene::Material description;
        double geometric, phase_integral, bond;
    };
    for (const Stated& stated :
         {Stated{"moon", moon(), 0.136, 0.529, 0.0721}, Stated{"eros", eros(), 0.230, 0.382, 0.088},
          Stated{"itokawa", itokawa(), 0.273, 0.385, 0.105},
          Stated{"67p", comet_67p(), 0.0636, 0.283, 0.0180}}) {
        INFO(stated.name);
        const auto material = make(stated.description);
        const double geometric = disc_albedo(*material, 0);
        const double q = phase_integral(*material);
        CHECK_THAT(geometric, WithinRel(stated.geometric, 0.005));
        CHECK_THAT(q, WithinRel(stated.phase_integral, 0.005));
        CHECK_THAT(geometric * q, WithinRel(stated.bond, 0.01));
    }
    // The phase curve's law: geometric albedo and, of the moons, phase integral are given.
    for (const Stated& stated :
         {Stated{"mercury", mercury(), 0.142, 0.48, 0.068}, Stated{"venus", venus(), 0.689, 1.35, 0.93},
          Stated{"earth", earth(), 0.434, 0.76, 0.33}, Stated{"mars", mars(), 0.170, 1.02, 0.173},
          Stated{"jupiter", jupiter(), 0.538, 1.31, 0.707}, Stated{"saturn", saturn(), 0.499, 1.36, 0.678},
          Stated{"io", io(), 0.63, 0.80, 0.504}, Stated{"europa", europa(), 0.67, 1.09, 0.73},
          Stated{"ganymede", ganymede(), 0.44, 0.80, 0.352},
          Stated{"callisto", callisto(), 0.20, 0.60, 0.120}}) {
        INFO(stated.name);
        const auto material = make(stated.description);
        const double q = phase_integral(*material);
        CHECK_THAT(disc_albedo(*material, 0), WithinRel(stated.geometric, 0.001));
        CHECK_THAT(q, WithinRel(stated.phase_integral, 0.01));
        CHECK_THAT(stated.geometric * q, WithinRel(stated.bond, 0.01));
    }
    // What the sources give: see presets.cpp.
    CHECK_THAT(disc_albedo(*make(eros()), 0), WithinRel(0.23, 0.02));
    CHECK_THAT(disc_albedo(*make(itokawa()), 0), WithinRel(0.27, 0.02));
    CHECK_THAT(disc_albedo(*make(comet_67p()), 0), WithinRel(0.065, 0.03));
}

TEST_CASE("Surfaces of spacecraft reflect what their absorptance leaves") {
    struct Stated {
        const char* name;
        scene::Material description;
        double absorptance, at_normal, bond;
    };
    for (const Stated& stated :
         {Stated{"mli", mli(), 0.40, 0.589, 0.589}, Stated{"solar-cell", solar_cell(), 0.88, 0.114, 0.148},
          Stated{"white-paint", white_paint(), 0.12, 0.880, 0.880}}) {
        INFO(stated.name);
        const auto material = make(stated.description);
        CHECK_THAT(hemispherical(*material, 1), WithinAbs(stated.at_normal, 0.001));
        CHECK_THAT(stated.at_normal, WithinAbs(1 - stated.absorptance, 0.012));
        CHECK_THAT(bond_by_hemispheres(*material), WithinAbs(stated.bond, 0.001));
    }
}

TEST_CASE("The Moon has the disc-integrated brightness of published photometry") {
    const auto material = make(moon());
    for (const double phase : {2.0, 3.0, 4.0, 5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0,
                               90.0, 97.0, 105.0, 112.0, 120.0}) {
        INFO("phase " << phase << " deg");
        const double albedo = disc_albedo(*material, phase * deg);
        CHECK_THAT(albedo, WithinRel(rolo_553_nm(phase), 0.05));
        if (phase >= 4) CHECK_THAT(albedo, WithinRel(allen_v(phase), 0.05));
    }
}

TEST_CASE("Every law with an albedo can be given its normal albedo") {
    for (const std::string law : {"lambert", "lommel-seeliger", "lunar-lambert", "minnaert", "oren-nayar",
                                  "white-paint", "ganymede"}) {
        INFO(law);
        const scene::Scene scene = scene_with("material = \"" + law + "\"\nnormal_albedo = 0.1\n");
        const auto material = make(scene.bodies[0].material);
        CHECK_THAT(pi * reflectance(*material, 1, 1, 1), WithinRel(0.1, 1e-12));
        CHECK_THAT(normal_albedo(scene.bodies[0].material), WithinRel(0.1, 1e-12));
    }
    const auto refused = [](const std::string& keys) -> std::string {
        try {
            (void)scene_with(keys);
        } catch (const Error& e) {
            return e.what();
        }
        return "accepted";
    };
    CHECK_THAT(refused("material = \"lommel-seeliger\"\nnormal_albedo = 0.2\n"),
               ContainsSubstring("normal_albedo: 0.2: allowed 0 to 0.125 with this law"));
    CHECK_THAT(refused("material = \"lambert\"\nnormal_albedo = 0.2\nalbedo = 0.2\n"),
               ContainsSubstring("normal_albedo: cannot stand beside \"albedo\""));
    CHECK_THAT(refused("material = \"hapke\"\nsingle_scattering_albedo = 0.3\nnormal_albedo = 0.2\n"),
               ContainsSubstring("normal_albedo: belongs to material ="));
    CHECK_THAT(refused("material = \"lambert\"\n"), ContainsSubstring("the key \"albedo\" is missing"));
}

TEST_CASE("the single-scattering albedo of Eros follows the spectrum unless a scene gives a colour") {
    const std::string visible = "[[band]]\nfrom_nm = 549\nto_nm = 551\n";
    const std::string infrared = "[[band]]\nfrom_nm = 949\nto_nm = 951\n";
    // Radiance factors for w = 0.33 and 0.33 times 1.08, the S class at 950 nm (DeMeo et al. 2009), b 0.25, c
    // 1, B0 1.4, h 0.010, 28 degrees: Hapke (2012) in Python.
    struct Geometry {
        double incidence_deg, emission_deg, azimuth_deg, at_550, at_950;
    };
    for (const auto& g :
         {Geometry{30, 0, 0, 0.085325, 0.093308}, Geometry{60, 30, 90, 0.038578, 0.042391},
          Geometry{50, 46, 180, 0.031357, 0.034639}, Geometry{70, 40, 170, 0.014504, 0.016047}}) {
        INFO(g.incidence_deg << " " << g.emission_deg << " " << g.azimuth_deg);
        const double i = g.incidence_deg * deg, e = g.emission_deg * deg;
        const auto radiance_factor = [&](const scene::Scene& scene, std::size_t band) {
            const double cos_phase =
                std::cos(i) * std::cos(e) + std::sin(i) * std::sin(e) * std::cos(g.azimuth_deg * deg);
            return pi * scene.bodies[0].colour.at(band) *
                   reflectance(*make(scene.bodies[0].material), std::cos(i), std::cos(e), cos_phase);
        };
        CHECK_THAT(radiance_factor(scene_with("material = \"eros\"\n" + visible), 0),
                   WithinRel(g.at_550, 1e-3));
        CHECK_THAT(radiance_factor(scene_with("material = \"eros\"\n" + infrared), 0),
                   WithinRel(g.at_950, 1e-3));
        // Several bands share a law: the factor between them is that of 90 degrees of phase.
        const scene::Scene both = scene_with("material = \"eros\"\n" + visible + infrared);
        CHECK_THAT(radiance_factor(both, 0), WithinRel(g.at_550, 0.01));
        CHECK_THAT(radiance_factor(both, 1), WithinRel(g.at_950, 0.01));
    }
    const scene::Scene given = scene_with("material = \"eros\"\ncolour = [1, 1]\n" + visible + infrared);
    CHECK(given.bodies[0].colour[1] == 1);
    CHECK(given.bodies[0].material.get<HapkeParameters>().single_scattering_albedo == 0.33);
    const scene::Scene own = scene_with("material = \"eros\"\nsingle_scattering_albedo = 0.2\n" + infrared);
    CHECK_THAT(own.bodies[0].material.get<HapkeParameters>().single_scattering_albedo,
               WithinRel(0.2 * 1.08, 1e-3));
    const scene::Scene grey = scene_with("material = \"moon\"\n" + visible + infrared);
    for (const double factor : grey.bodies[0].colour)
        CHECK(factor == 1);
}

TEST_CASE("presets out of range are named with the range, the source and what is there instead") {
    const auto lines = [](const std::string& keys, double phase_deg, bool in_field = true) {
        const scene::Scene scene = scene_with(keys);
        View view;
        view.bodies.resize(scene.bodies.size());
        view.bodies[0].phase_rad = phase_deg * deg;
        view.bodies[0].in_field = in_field;
        return presets_out_of_range(scene, view);
    };
    const std::string panchromatic = "[[band]]\nfrom_nm = 400\nto_nm = 1000\n";
    const std::string late = "[[band]]\nfrom_nm = 400\nto_nm = 700\n[[band]]\nfrom_nm = 1200\nto_nm = 1300\n";
    CHECK(lines("material = \"eros\"\n" + panchromatic, 100).empty());
    CHECK(lines("material = \"moon\"\n" + panchromatic, 100).empty());
    CHECK(lines("material = \"lambert\"\nalbedo = 0.1\n" + late, 100).empty());
    const auto eros = lines("material = \"eros\"\n" + late, 100);
    REQUIRE(eros.size() == 1);
    CHECK_THAT(
        eros[0],
        ContainsSubstring("has material = \"eros\", which is known from 450 to 1050 nm (Li 2005, NEAR MSI), "
                          "and the mean wavelength of band 2 is 12"));
    const auto io = lines("material = \"io\"\n" + panchromatic, 30);
    REQUIRE(io.size() == 1);
    CHECK_THAT(io[0],
               ContainsSubstring("at phase angles of 0 to 12 deg (Harris 1961, Morrison and Morrison 1977), "
                                 "and is seen at a phase angle of 30 deg"));
    CHECK(lines("material = \"io\"\n" + panchromatic, 30, false).empty());
    CHECK(lines("material = \"io\"\n" + panchromatic, 11).empty());
    CHECK(lines("material = \"moon\"\n" + panchromatic, 1).size() == 1);
    // Every preset has a range, and a source for it.
    for (const MaterialKind& kind : material_kinds()) {
        INFO(kind.name);
        CHECK((kind.range.to_nm > kind.range.from_nm) == kind.preset);
        CHECK(kind.range.source.empty() != kind.preset);
    }
}

TEST_CASE("A sphere of the phase curve's law has the phase curve") {
    for (const double share : {0.0, 0.4, 1.0}) {
        const auto material =
            make(PhaseCurveParameters{0.5, {0, 5, 30, 90, 150}, {0, 0.2, 0.8, 2.1, 5}, share});
        for (const auto& [phase_deg, magnitude] :
             {std::pair{0.0, 0.0}, {5.0, 0.2}, {30.0, 0.8}, {90.0, 2.1}, {150.0, 5.0}}) {
            INFO("share " << share << ", phase " << phase_deg);
            CHECK_THAT(disc_albedo(*material, phase_deg * deg),
                       WithinRel(0.5 * std::pow(10, -0.4 * magnitude), 3e-3));
        }
        // Limb darkening of the full disc: none by Lommel-Seeliger, Lambert's cosine.
        CHECK_THAT(reflectance(*material, 0.3, 0.3, 1) / reflectance(*material, 1, 1, 1),
                   WithinRel(share + (1 - share) * 0.3, 1e-9));
    }
    const auto refused = [](const PhaseCurveParameters& p) -> std::string {
        try {
            (void)make(p);
        } catch (const Error& e) {
            return e.what();
        }
        return "accepted";
    };
    CHECK_THAT(refused({0.5, {0, 5, 5}, {0, 1, 2}, 0.5}),
               ContainsSubstring("two or more angles that begin at 0 and increase"));
    CHECK_THAT(refused({0.5, {}, {}, 0.5}), ContainsSubstring("two or more angles"));
    CHECK_THAT(refused({0.5, {0, 5}, {0, 1, 2}, 0.5}), ContainsSubstring("3 magnitudes, allowed as many"));
    CHECK_THAT(refused({0.5, {0, 5}, {0.1, 1}, 0.5}), ContainsSubstring("the first magnitude must be 0"));
}

} // namespace albedos_test
