// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "core/geometry.hpp"
#include "models/kinds/material_program.hpp"
#include "tests/support/catch.hpp"

#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

namespace material_program_test {

using namespace obscura;
using namespace obscura::models;
using std::numbers::pi;

namespace {

constexpr std::string_view head =
    "vec4 brdf(vec3 $i, vec3 $e, vec3 n, vec4 diffuse, vec4 specular, scalar shininess)\n";

struct Angles {
    std::vector<double> in, out, phase;
    std::vector<Vec3> light, camera;
};

Angles angles() {
    Angles a;
    for (int i = 0; i < 8; ++i)
        for (int k = 0; k < 8; ++k)
            for (int m = 0; m < 8; ++m) {
                const double t0 = pi / 2 * (i + 0.5) / 8, t1 = pi / 2 * (k + 0.3) / 8, azimuth = pi * m / 7.5;
                const Vec3 light{std::sin(t0) * std::cos(azimuth), std::sin(t0) * std::sin(azimuth),
                                 std::cos(t0)};
                const Vec3 camera{std::sin(t1), 0, std::cos(t1)};
                a.light.push_back(light);
                a.camera.push_back(camera);
                a.in.push_back(light.z);
                a.out.push_back(camera.z);
                a.phase.push_back(dot(light, camera));
            }
    return a;
}

/// Values of each channel; all rows but those given are 0: varied parameters, and texels of the first read.
std::vector<std::vector<double>> channels_of(const MaterialProgram& law, const Angles& a,
                                             const std::vector<std::vector<double>>& varied,
                                             const std::vector<std::vector<double>>& texels) {
    const std::vector<double> zero(a.in.size());
    std::vector<const double*> rows(law.rows(), zero.data());
    for (std::size_t k = 0; k < varied.size(); ++k)
        rows[k] = varied[k].data();
    for (std::size_t k = 0; k < texels.size(); ++k)
        rows[law.first_read_row() + k] = texels[k].data();
    std::vector<std::vector<double>> r(law.outputs(), std::vector<double>(a.in.size()));
    std::vector<double*> out;
    for (std::vector<double>& row : r)
        out.push_back(row.data());
    law.evaluate(a.in.data(), a.out.data(), a.phase.data(), rows.data(), out.data(), a.in.size());
    return r;
}
std::vector<double> evaluated(const MaterialProgram& law, const Angles& a,
                              const std::vector<std::vector<double>>& varied = {},
                              const std::vector<std::vector<double>>& texels = {}) {
    return channels_of(law, a, varied, texels)[0];
}

/// Largest relative difference of a law's text from `formula` of the directions to light and camera.
double difference(const std::string& text, const std::function<double(Vec3 light, Vec3 camera)>& formula) {
    const auto model = Model::parse("m.brdf", text);
    const Angles a = angles();
    const std::vector<double> r = evaluated(MaterialProgram(model, {default_parameters(*model)}), a);
    double most = 0;
    for (std::size_t i = 0; i < r.size(); ++i) {
        const double expected = formula(a.light[i], a.camera[i]);
        most = std::max(most, std::abs(r[i] - expected) / std::max(std::abs(expected), 1e-6));
    }
    return most;
}

std::string refusal(const std::string& text) {
    try {
        const auto model = Model::parse("m.brdf", text);
        const MaterialProgram law(model, {default_parameters(*model)});
        return "";
    } catch (const ConfigError& error) {
        return error.what();
    }
}

} // namespace

TEST_CASE("laws give what the C library computes by their formulas", "[models]") {
    CHECK(difference(std::string(head) + "{ return diffuse * max(0.0, (i|n)) * M_1_PI; }",
                     [](Vec3 i, Vec3) { return i.z / pi; }) < 1e-15);
    // Minnaert.
    CHECK(difference("parameter k 0.7;\n" + std::string(head) +
                         "{ scalar mu0 = (i | n); scalar mu = (e | n);\n"
                         "  if (mu0 <= 0 || mu <= 0) return vec4(0);\n"
                         "  return diffuse * exp((k - 1) * log(mu)) * exp(k * log(mu0)) * M_1_PI; }",
                     [](Vec3 i, Vec3 e) { return std::pow(i.z, 0.7) * std::pow(e.z, -0.3) / pi; }) < 1e-13);
    // Phong's lobe about the mirror direction, by reflect().
    CHECK(difference("parameter m 12;\n" + std::string(head) +
                         "{ vec3 r = reflect(-i, n); scalar c = max(0, (r | e));\n"
                         "  return specular * (m + 2) / (2 * M_PI) * pow(c, m) * (i|n); }",
                     [](Vec3 i, Vec3 e) {
                         const double c = std::max(0.0, -i.x * e.x - i.y * e.y + i.z * e.z);
                         return 14 / (2 * pi) * std::pow(c, 12) * i.z;
                     }) < 1e-11);
    // Oren-Nayar with azimuths from the components of the directions.
    CHECK(difference("parameter sigma 0.4;\n"
                     "scalar cos_azimuth(vec3 a, vec3 b) {\n"
                     "  vec2 p = normalize(a.xy); vec2 q = normalize(b.xy); return max(0, (p | q)); }\n" +
                         std::string(head) +
                         "{ scalar s2 = sigma * sigma; scalar ti = acos((i|n)); scalar te = acos((e|n));\n"
                         "  scalar a = 1 - 0.5 * s2 / (s2 + 0.33); scalar b = 0.45 * s2 / (s2 + 0.09);\n"
                         "  scalar rough = a + b * cos_azimuth(i, e) * sin(max(ti, te)) * tan(min(ti, te));\n"
                         "  return diffuse * rough * (i | n) / M_PI; }",
                     [](Vec3 i, Vec3 e) {
                         const double s2 = 0.16, ti = std::acos(i.z), te = std::acos(e.z);
                         const double azimuth = std::atan2(i.y, i.x) - std::atan2(e.y, e.x);
                         const double rough = 1 - 0.5 * s2 / (s2 + 0.33) +
                                              0.45 * s2 / (s2 + 0.09) * std::max(0.0, std::cos(azimuth)) *
                                                  std::sin(std::max(ti, te)) * std::tan(std::min(ti, te));
                         return rough * i.z / pi;
                     }) < 1e-12);
}

TEST_CASE("branches, loops and early returns give what C gives", "[models]") {
    CHECK(difference("scalar series(scalar x, scalar limit) {\n"
                     "  scalar sum = 0;\n"
                     "  scalar last;\n"
                     "  for (scalar k = 0; k < 6; ++k) {\n"
                     "    if (sum > limit) return sum;\n"
                     "    if (x > 0.5 && k >= 2) last = x / (k + 1);\n"
                     "    else { last = 0.25; if (x < 0.2) last *= 2; }\n"
                     "    sum += last;\n"
                     "  }\n"
                     "  vec2 both = sum;\n"
                     "  both.y -= x == 1 || !(x < 0.9) ? 3 : 1 / 2;\n"
                     "  return both.y - last;\n"
                     "}\n" +
                         std::string(head) + "{ return vec4(series((i|n), 1.3)); }",
                     [](Vec3 i, Vec3) {
                         const double x = i.z;
                         double sum = 0, last = 0;
                         for (int k = 0; k < 6; ++k) {
                             if (sum > 1.3) return sum;
                             last = x > 0.5 && k >= 2 ? x / (k + 1) : x < 0.2 ? 0.5 : 0.25;
                             sum += last;
                         }
                         return sum - (x == 1 || x >= 0.9 ? 3 : 0.5) - last;
                     }) < 1e-14);
}

TEST_CASE("a parameter may come lane by lane", "[models]") {
    const auto model =
        Model::parse("m.brdf", "parameter k 0.5;\nparameter texture map;\n"
                               "vec4 brdf(vec3 i, vec3 e, vec3 n, vec4 d, vec4 s, scalar sh, scalar t, "
                               "scalar duration, vec3 uv, scalar lod_bias)\n"
                               "{ return d * k * lookup3DLOD(map, uv, lod_bias).y * (i|n); }");
    MaterialParameters parameters{default_parameters(*model)};
    const Angles a = angles();
    std::vector<double> texels(a.in.size());
    for (std::size_t i = 0; i < texels.size(); ++i)
        texels[i] = 0.001 * static_cast<double>(i);
    const std::vector<double> none(a.in.size()), k(a.in.size(), 0.5);
    const MaterialProgram law(model, parameters);
    REQUIRE(law.reads().size() == 1);
    CHECK(law.reads()[0].own_place);
    const std::vector<double> r = evaluated(law, a, {}, {none, texels, none, none});
    parameters.varied = {0};
    const MaterialProgram both(model, parameters);
    const std::vector<double> varied = evaluated(both, a, {k}, {none, texels, none, none});
    for (std::size_t i = 0; i < r.size(); ++i) {
        CHECK(r[i] == 0.5 * texels[i] * a.in[i]);
        CHECK(varied[i] == r[i]);
    }
    CHECK(both.is_proportional_to_diffuse());
}

TEST_CASE("channels are bands", "[models]") {
    const auto model = Model::parse("m.brdf", "parameter c vec4(1, 2, 3, 4);\n" + std::string(head) +
                                                  "{ return diffuse * c * c.x * (i|n); }");
    MaterialParameters parameters{default_parameters(*model)};
    const Angles a = angles();
    const auto values = [&](std::size_t bands, std::vector<double> channels) {
        parameters.bands = bands;
        parameters.channels[0] = std::move(channels);
        std::vector<double> out;
        for (const std::vector<double>& channel : channels_of(MaterialProgram(model, parameters), a, {}, {}))
            out.push_back(channel[5] / a.in[5]);
        return out;
    };
    using Numbers = std::vector<double>;
    const auto near = [](const Numbers& given, const Numbers& expected) {
        REQUIRE(given.size() == expected.size());
        for (std::size_t i = 0; i < given.size(); ++i)
            CHECK(std::abs(given[i] - expected[i]) < 1e-12 * expected[i]);
    };
    near(values(4, {1, 2, 3, 4}), {1, 2, 3, 4});
    near(values(2, {1, 2, 3, 4}), {1, 2});
    near(values(6, {2, 3, 4, 5}), {4, 6, 8, 10, 4, 6});
    near(values(6, {1, 2, 3, 4, 5, 6}), {1, 2, 3, 4, 25, 30});
    near(values(6, {3, 3, 3, 3, 3, 3}), {9});
    near(values(16, {1}), {1});
}

TEST_CASE("emission has the argument of its body", "[models]") {
    const auto model = Model::parse(
        "m.brdf", std::string(head) +
                      "{ return vec4(0); }\n"
                      "vec4 emission(vec3 e, vec3 n, vec4 emission, vec4 diffuse, vec4 specular, scalar sh)\n"
                      "{ return emission * 2 * (e | n); }");
    MaterialParameters parameters{default_parameters(*model)};
    parameters.bands = 3;
    parameters.emission = {1, 2, 3};
    const Angles a = angles();
    const MaterialProgram same(model, parameters, MaterialFunction::emission);
    const auto r = channels_of(same, a, {}, {});
    parameters.emission_varies = true;
    const MaterialProgram varies(model, parameters, MaterialFunction::emission);
    std::vector<std::vector<double>> rows(5, std::vector<double>(a.in.size()));
    for (double k : {1.0, 2.0, 3.0})
        rows.emplace_back(a.in.size(), k);
    const auto v = channels_of(varies, a, rows, {});
    REQUIRE((r.size() == 3 && v.size() == 3));
    for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t i = 0; i < a.in.size(); ++i) {
            CHECK(r[c][i] == static_cast<double>(c + 1) * 2 * a.out[i]);
            CHECK(v[c][i] == r[c][i]);
        }
    parameters.emission.clear();
    parameters.emission_varies = false;
    CHECK(channels_of(MaterialProgram(model, parameters, MaterialFunction::emission), a, {}, {})[0][0] == 0);
}

TEST_CASE("machine code gives the bits of the interpreter", "[models]") {
    const std::string text =
        "parameter k 0.7;\nparameter texture map;\n"
        "vec4 brdf(vec3 i, vec3 e, vec3 n, vec4 d, vec4 s, scalar sh, scalar t, scalar duration, "
        "vec3 uv, scalar lod_bias)\n"
        "{ vec3 r = reflect(-i, n); scalar x = lookup3DLOD(map, uv, lod_bias).x;\n"
        "  scalar y = atan2(r.x, e.x) + asin(r.y) * tan(k) - pow(x, (i|e)) + log2(x + 0.1);\n"
        "  if (y > 0.3 && !(x < 0.2) || (i|e) == 1) return d * sin(y) * cos(x);\n"
        "  return d * exp(-y) * floor(8 * x) * acos(x); }";
    const auto model = Model::parse("m.brdf", text);
    const Angles a = angles();
    std::vector<std::vector<double>> texels(4, std::vector<double>(a.in.size()));
    for (std::size_t i = 0; i < a.in.size(); ++i)
        texels[0][i] = static_cast<double>(i) / static_cast<double>(a.in.size());
    MaterialParameters parameters{default_parameters(*model)};
    parameters.target = NativeTarget::none;
    const MaterialProgram interpreted(model, parameters);
    CHECK_FALSE(interpreted.why_interpreted().empty());
    const std::vector<double> expected = evaluated(interpreted, a, {}, texels);
    for (const NativeTarget target : {NativeTarget::avx2, NativeTarget::avx512}) {
        if (target > native_target()) continue;
        parameters.target = target;
        const MaterialProgram native(model, parameters);
        CHECK(native.why_interpreted() == "");
        CHECK(evaluated(native, a, {}, texels) == expected);
    }
}

TEST_CASE("what a renderer cannot do with a law is refused", "[models]") {
    const std::string ten =
        "vec4 brdf(vec3 i, vec3 e, vec3 n, vec4 d, vec4 s, scalar sh, scalar t, scalar duration, "
        "vec3 uv, scalar lod_bias)\n";
    CHECK(refusal(ten + "{ return d * t * uv.x; }").empty());
    CHECK(
        refusal("parameter texture a;\n" + ten + "{ return lookup3DLOD(a, uv * 2, lod_bias + 1); }").empty());
    CHECK(refusal("parameter texture a;\n" + ten + "{ return lookup3DLOD(a, uv, (i|n)); }") ==
          "m.brdf:3:10: the place of a texture that is read must not depend on directions");
    CHECK(refusal("parameter texture a;\n" + ten + "{ return lookup3DLOD(a, t, lod_bias); }") ==
          "m.brdf:3:10: lookup3DLOD() takes texture, vec3, scalar");
    CHECK(refusal(ten + "{ return d; }").empty());
}

TEST_CASE("the share of colours in a law is found", "[models]") {
    const auto proportional = [](const std::string& body) {
        const auto model = Model::parse("m.brdf", std::string(head) + body);
        return MaterialProgram(model, {default_parameters(*model)}).is_proportional_to_diffuse();
    };
    CHECK(proportional("{ return diffuse * (i|n) * (i|e); }"));
    CHECK_FALSE(proportional("{ return diffuse * diffuse * (i|n); }"));
    CHECK_FALSE(proportional("{ return vec4((i|n)); }"));
    CHECK_FALSE(proportional("{ return diffuse * 0.5 + 0.1 * specular; }"));
}

} // namespace material_program_test
