// SPDX-License-Identifier: Apache-2.0
// Every scattering law against formulas written another way, reciprocity, energy, and its own sampling.
#include "core/philox.hpp"
#include "renderer/materials/ggx.hpp"
#include "renderer/materials/hapke.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/materials/lommel_seeliger.hpp"
#include "renderer/materials/lunar_lambert.hpp"
#include "renderer/materials/material.hpp"
#include "renderer/materials/minnaert.hpp"
#include "renderer/materials/oren_nayar.hpp"
#include "renderer/materials/phase_curve.hpp"
#include "renderer/materials/phong.hpp"
#include "renderer/materials/registry.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

namespace scattering_laws_test {

using namespace obscura;
using namespace obscura::renderer;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double pi = std::numbers::pi;

struct Law {
    std::string name;
    scene::Material description;
};

const std::vector<Law>& laws() {
    static const std::vector<Law> all{
        {"lambert", renderer::LambertParameters{0.7}},
        {"lommel-seeliger", renderer::LommelSeeligerParameters{0.3}},
        {"lunar-lambert", renderer::LunarLambertParameters{0.12, {1, -0.019, 2.42e-4, -1.46e-6}}},
        {"minnaert", renderer::MinnaertParameters{0.5, 0.8}},
        {"oren-nayar", renderer::OrenNayarParameters{0.8, 0.5}},
        {"phong", renderer::PhongParameters{0.3, 0.5, 20}},
        {"hapke rough", renderer::HapkeParameters{0.4, 0.3, 0.6, 1.2, 0.05, 0.4, 0.08, 25 * pi / 180, 0.3}},
        {"hapke smooth", renderer::HapkeParameters{0.9, 0.2, 0.2, 0.5, 0.1, 0, 0.1, 0, 0}},
        {"phase-curve", renderer::PhaseCurveParameters{0.4, {0, 10, 60, 120}, {0, 0.3, 1.2, 3}, 0.6}},
        {"ggx metal", renderer::GgxParameters{0.4, 0.9, 0}},
        {"ggx dielectric", renderer::GgxParameters{0.3, 0.04, 0.6}},
    };
    return all;
}

std::unique_ptr<Material> make(const scene::Material& d) {
    return make_material(d, "test");
}

/// r for one pair of unit vectors in the local frame, z the normal.
double reflectance(const Material& material, Vec3 in, Vec3 out) {
    ScatterPacket s{};
    for (int i = 0; i < packet_size; ++i) {
        s.cos_in[i] = in.z;
        s.cos_out[i] = out.z;
        s.cos_phase[i] = dot(in, out);
    }
    Doubles r;
    material.reflectance(s, r);
    return r[3];
}

Vec3 direction(double theta, double phi) {
    return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

double uniform(std::uint32_t n, std::uint32_t stream) {
    return uniform_double(philox4x32({n, stream, 0, 0}, {5, 6})[0]);
}

/// Hapke's model from the angles, with the library's functions and his own case distinction (2012, chapter
/// 12).
double hapke_by_the_book(const renderer::HapkeParameters& d, double i, double e, double g) {
    const double w = d.single_scattering_albedo;
    const double filling = 1.209 * std::pow(d.filling_factor, 2.0 / 3);
    const double k = filling > 0 ? -std::log(1 - filling) / filling : 1;
    const double gamma = std::sqrt(1 - w);
    const double r0 = (1 - gamma) / (1 + gamma);
    const auto h_function = [&](double x) {
        return 1 / (1 - w * x * (r0 + (1 - 2 * r0 * x) / 2 * std::log((1 + x) / x)));
    };
    const double b = d.phase_b;
    const double p = (1 + d.phase_c) / 2 * (1 - b * b) / std::pow(1 - 2 * b * std::cos(g) + b * b, 1.5) +
                     (1 - d.phase_c) / 2 * (1 - b * b) / std::pow(1 + 2 * b * std::cos(g) + b * b, 1.5);
    const double bs = 1 / (1 + std::tan(g / 2) / d.shadow_hiding_h);
    const double z = std::tan(g / 2) / d.backscatter_h;
    const double bc = (1 + (z > 0 ? -std::expm1(-z) / z : 1.0)) / (2 * (1 + z) * (1 + z));

    double mu0e = std::cos(i);
    double mue = std::cos(e);
    double s = 1;
    if (d.roughness_rad > 0) {
        const double t = d.roughness_rad;
        const double cos_psi = (std::cos(g) - std::cos(i) * std::cos(e)) / (std::sin(i) * std::sin(e));
        const double psi = std::acos(std::fmin(1, std::fmax(-1, cos_psi)));
        const double chi = 1 / std::sqrt(1 + pi * std::tan(t) * std::tan(t));
        const auto e1 = [&](double x) { return std::exp(-2 / pi / std::tan(t) / std::tan(x)); };
        const auto e2 = [&](double x) { return std::exp(-1 / pi / std::pow(std::tan(t) * std::tan(x), 2)); };
        const auto eta = [&](double x) {
            return chi * (std::cos(x) + std::sin(x) * std::tan(t) * e2(x) / (2 - e1(x)));
        };
        const double f = std::exp(-2 * std::tan(psi / 2));
        const double half = std::pow(std::sin(psi / 2), 2);
        if (i <= e) {
            const double n = 2 - e1(e) - psi / pi * e1(i);
            mu0e =
                chi * (std::cos(i) + std::sin(i) * std::tan(t) * (std::cos(psi) * e2(e) + half * e2(i)) / n);
            mue = chi * (std::cos(e) + std::sin(e) * std::tan(t) * (e2(e) - half * e2(i)) / n);
            s = mue / eta(e) * std::cos(i) / eta(i) * chi / (1 - f + f * chi * std::cos(i) / eta(i));
        } else {
            const double n = 2 - e1(i) - psi / pi * e1(e);
            mu0e = chi * (std::cos(i) + std::sin(i) * std::tan(t) * (e2(i) - half * e2(e)) / n);
            mue =
                chi * (std::cos(e) + std::sin(e) * std::tan(t) * (std::cos(psi) * e2(i) + half * e2(e)) / n);
            s = mue / eta(e) * std::cos(i) / eta(i) * chi / (1 - f + f * chi * std::cos(e) / eta(e));
        }
    }
    return k * w / (4 * pi) * mu0e / (mu0e + mue) *
           (p * (1 + d.shadow_hiding_b0 * bs) + h_function(mu0e / k) * h_function(mue / k) - 1) *
           (1 + d.backscatter_b0 * bc) * s;
}

/// Share of the light from `in` that leaves into the hemisphere, by quadrature over the outgoing directions.
double directional_albedo(const Material& material, double theta_in) {
    const Vec3 in = direction(theta_in, 0);
    constexpr int steps = 250;
    double sum = 0;
    for (int a = 0; a < steps; ++a) {
        const double mu = (a + 0.5) / steps;
        for (int c = 0; c < steps; ++c) {
            const Vec3 out = direction(std::acos(mu), pi * (c + 0.5) / steps);
            sum += reflectance(material, in, out) / in.z * mu;
        }
    }
    return sum * 2 * pi / steps / steps; // symmetric in azimuth, so half the turn counts twice
}

} // namespace

TEST_CASE("Hapke's model agrees with its formulas written from the angles") {
    const renderer::HapkeParameters base{0.4, 0.3, 0.6, 1.2, 0.05, 0.4, 0.08, 25 * pi / 180, 0.3};
    for (int variant = 0; variant < 4; ++variant) {
        renderer::HapkeParameters d = base;
        if (variant == 1) d.roughness_rad = 0;
        if (variant == 2) d.filling_factor = 0;
        if (variant == 3) d = {0.95, 0.1, -0.4, 0, 0.1, 1, 0.02, 8 * pi / 180, 0};
        const auto material = make(d);
        double worst = 0;
        for (std::uint32_t n = 0; n < 20'000; ++n) {
            const double i = 0.01 + 1.5 * uniform(n, 0);
            const double e = 0.01 + 1.5 * uniform(n, 1);
            const Vec3 in = direction(i, 0);
            const Vec3 out = direction(e, 0.001 + 3.14 * uniform(n, 2));
            const double expected = hapke_by_the_book(d, i, e, std::acos(dot(in, out)));
            worst = std::fmax(worst, std::fabs(reflectance(*material, in, out) / expected - 1));
        }
        CHECK(worst < 1e-8);
    }
}

TEST_CASE("Hapke's roughness is continuous where the Sun or the viewer is in the zenith") {
    const auto hapke = make(renderer::HapkeParameters{0.4, 0.3, 0.6, 0, 0.05, 0, 0.08, 25 * pi / 180, 0.3});
    for (const double angle : {0.3, 0.8, 1.2, 1.5})
        for (const double azimuth : {0.0, 1.0, 3.0}) {
            const double near = 1e-5, phase = std::cos(angle) * std::cos(near) +
                                              std::sin(angle) * std::sin(near) * std::cos(azimuth);
            renderer::ScatterPacket s{};
            const auto at = [&](int lane, double in, double out, double cos_phase) {
                s.cos_in[lane] = std::cos(in);
                s.cos_out[lane] = std::cos(out);
                s.cos_phase[lane] = cos_phase;
            };
            for (int i = 4; i < renderer::packet_size; ++i)
                at(i, 0, 0, 1);
            at(0, angle, 0, std::cos(angle));
            at(1, angle, near, phase);
            at(2, 0, angle, std::cos(angle));
            at(3, near, angle, phase);
            renderer::Doubles r;
            hapke->reflectance(s, r);
            INFO(angle << ", azimuth " << azimuth);
            CHECK_THAT(r[0], WithinRel(r[1], 1e-3));
            CHECK_THAT(r[2], WithinRel(r[3], 1e-3));
        }
}

TEST_CASE("Hapke's model without its refinements is Lommel-Seeliger in the limit of dark grains") {
    const auto hapke = make(renderer::HapkeParameters{1e-6, 0, 0, 0, 1, 0, 1, 0, 0});
    const auto ls = make(renderer::LommelSeeligerParameters{1e-6});
    for (const double i : {0.1, 0.7, 1.3})
        for (const double e : {0.2, 0.9, 1.4})
            CHECK_THAT(reflectance(*hapke, direction(i, 0), direction(e, 1)),
                       WithinRel(reflectance(*ls, direction(i, 0), direction(e, 1)), 1e-5));
}

TEST_CASE("a vanishing roughness is no roughness") {
    renderer::HapkeParameters d{0.5, 0.3, 0.5, 1, 0.05, 0, 0.1, 0, 0};
    const auto smooth = make(d);
    d.roughness_rad = 2e-4;
    const auto barely = make(d);
    for (const double i : {0.1, 0.7, 1.2})
        for (const double e : {0.2, 0.9, 1.2})
            CHECK_THAT(reflectance(*barely, direction(i, 0), direction(e, 2)),
                       WithinRel(reflectance(*smooth, direction(i, 0), direction(e, 2)), 1e-5));
}

TEST_CASE("the simple laws are their textbook formulas") {
    const Vec3 in = direction(0.6, 0);
    const Vec3 out = direction(0.9, 2.0);
    const double mu0 = in.z;
    const double mu = out.z;
    const double g = std::acos(dot(in, out)) * 180 / pi;

    const double l = 1 - 0.019 * g + 2.42e-4 * g * g - 1.46e-6 * g * g * g;
    CHECK_THAT(reflectance(*make(laws()[2].description), in, out),
               WithinRel(0.12 / pi * (2 * l * mu0 / (mu0 + mu) + (1 - l) * mu0), 1e-12));
    CHECK_THAT(reflectance(*make(laws()[3].description), in, out),
               WithinRel(0.5 / pi * std::pow(mu0, 0.8) * std::pow(mu, -0.2), 1e-12));
    CHECK_THAT(reflectance(*make(renderer::MinnaertParameters{0.5, 1}), in, out),
               WithinRel(0.5 / pi * mu0, 1e-12));
    CHECK_THAT(reflectance(*make(renderer::OrenNayarParameters{0.8, 0}), in, out),
               WithinRel(0.8 / pi * mu0, 1e-12));
    // Same side of the normal, so that the retroreflecting lobe of Oren and Nayar shows.
    const Vec3 back = direction(0.9, 0.3);
    const double s2 = 0.25;
    CHECK_THAT(reflectance(*make(laws()[4].description), in, back),
               WithinRel(0.8 / pi * mu0 *
                             (1 - 0.5 * s2 / (s2 + 0.33) +
                              0.45 * s2 / (s2 + 0.09) * std::cos(0.3) * std::sin(0.9) * std::tan(0.6)),
                         1e-12));
    // Phong: the angle to the mirror direction from vectors.
    const Vec3 mirrored{-in.x, -in.y, in.z};
    CHECK_THAT(reflectance(*make(laws()[5].description), in, out),
               WithinRel(mu0 * (0.3 / pi + 0.5 * 22 / (2 * pi) * std::pow(dot(mirrored, out), 20)), 1e-9));
}

TEST_CASE("GGX is its formula written from the half vector") {
    const double alpha2 = std::pow(0.4, 4);
    const auto material = make(renderer::GgxParameters{0.4, 0.9, 0});
    for (std::uint32_t n = 0; n < 1000; ++n) {
        const Vec3 in = direction(1.5 * uniform(n, 0), 0);
        const Vec3 out = direction(1.5 * uniform(n, 1), 6.28 * uniform(n, 2));
        const Vec3 h = normalized(in + out);
        const double d = alpha2 / (pi * std::pow(h.z * h.z * (alpha2 - 1) + 1, 2));
        const auto lambda = [&](double c) { return (-1 + std::sqrt(1 + alpha2 * (1 / (c * c) - 1))) / 2; };
        const double f = 0.9 + 0.1 * std::pow(1 - dot(in, h), 5);
        const double expected = d * f / (1 + lambda(in.z) + lambda(out.z)) / (4 * in.z * out.z) * in.z;
        CHECK_THAT(reflectance(*material, in, out), WithinRel(expected, 1e-9));
    }
}

TEST_CASE("every law is reciprocal, positive, and dark where no light falls") {
    for (const Law& law : laws()) {
        INFO(law.name);
        const auto material = make(law.description);
        for (std::uint32_t n = 0; n < 2000; ++n) {
            const Vec3 in = direction(1.55 * uniform(n, 0), 0);
            const Vec3 out = direction(1.55 * uniform(n, 1), 2 * pi * uniform(n, 2));
            const double there = reflectance(*material, in, out) / in.z;
            const double back = reflectance(*material, out, in) / out.z;
            CHECK(there >= 0);
            CHECK(std::isfinite(there));
            CHECK_THAT(there - back, WithinAbs(0, 1e-8 * (there + back)));
        }
        CHECK(reflectance(*material, direction(1.8, 0), direction(0.3, 0)) == 0);
        CHECK(std::isfinite(reflectance(*material, direction(0, 0), direction(0, 0))));
        CHECK(std::isfinite(reflectance(*material, direction(1.5707963, 0), direction(1.5707963, pi))));
    }
}

TEST_CASE(
    "no law gives back more light than falls on it, and its sampling finds exactly what quadrature finds") {
    for (const Law& law : laws()) {
        const auto material = make(law.description);
        for (const double theta : {0.05, 0.6, 1.2}) {
            INFO(law.name << " at " << theta << " rad");
            const double albedo = directional_albedo(*material, theta);
            CHECK(albedo > 0);
            CHECK(albedo <= 1.0);

            // The furnace: light of radiance 1 from everywhere. By reciprocity the mean of r / pdf over
            // sampled directions of incidence is the same albedo.
            const Vec3 out = direction(theta, 0);
            double sum = 0;
            double squares = 0;
            constexpr int draws = 200'000;
            for (std::uint32_t n = 0; n < draws; ++n) {
                const Vec3 in = material->sample(out, uniform(n, 0), uniform(n, 1));
                const double density = material->pdf(out, in);
                const double weight =
                    in.z > 0 && density > 0 ? reflectance(*material, in, out) / density : 0.0;
                sum += weight;
                squares += weight * weight;
            }
            const double mean = sum / draws;
            const double deviation = std::sqrt((squares / draws - mean * mean) / draws);
            CHECK_THAT(mean, WithinAbs(albedo, 5 * deviation + 1e-3 * albedo));
        }
    }
}

TEST_CASE("sampled directions are distributed as the density says") {
    constexpr int rings = 8;
    constexpr int sectors = 8;
    constexpr int draws = 200'000;
    for (const Law& law : laws()) {
        INFO(law.name);
        const auto material = make(law.description);
        const Vec3 out = direction(0.8, 0);
        std::vector<double> counts(rings * sectors);
        double worst_length = 0;
        for (std::uint32_t n = 0; n < draws; ++n) {
            const Vec3 in = material->sample(out, uniform(n, 0), uniform(n, 1));
            worst_length = std::fmax(worst_length, std::fabs(length(in) - 1));
            if (in.z <= 0) continue;
            const int ring = std::min(rings - 1, static_cast<int>(in.z * rings));
            const double turn = (std::atan2(in.y, in.x) + pi) / (2 * pi);
            counts[static_cast<std::size_t>(ring * sectors +
                                            std::min(sectors - 1, static_cast<int>(turn * sectors)))] += 1;
        }
        CHECK(worst_length < 1e-9);
        double chi2 = 0;
        int cells = 0;
        for (int ring = 0; ring < rings; ++ring)
            for (int sector = 0; sector < sectors; ++sector) {
                double expected = 0;
                constexpr int fine = 60;
                for (int a = 0; a < fine; ++a)
                    for (int c = 0; c < fine; ++c) {
                        const double mu = (ring + (a + 0.5) / fine) / rings;
                        const double phi = ((sector + (c + 0.5) / fine) / sectors) * 2 * pi - pi;
                        expected += material->pdf(out, direction(std::acos(mu), phi));
                    }
                expected *= draws * 2 * pi / (rings * sectors) / (fine * fine);
                if (expected < 20) continue;
                const double difference =
                    counts[static_cast<std::size_t>(ring * sectors + sector)] - expected;
                chi2 += difference * difference / expected;
                ++cells;
            }
        // Mean `cells`, variance 2 cells; five sigma, and the quadrature's own error.
        CHECK(chi2 < cells + 5 * std::sqrt(2.0 * cells) + 5);
    }
}

} // namespace scattering_laws_test
