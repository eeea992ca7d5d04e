// SPDX-License-Identifier: Apache-2.0
// Parameters of scattering laws from images: lane by lane against the law made with that lane's numbers, and
// pictures against pictures with constants.
#include "core/error.hpp"
#include "core/philox.hpp"
#include "images/writers/fits.hpp"
#include "images/writers/png.hpp"
#include "renderer/materials/ggx.hpp"
#include "renderer/materials/hapke.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/materials/lunar_lambert.hpp"
#include "renderer/materials/material.hpp"
#include "renderer/materials/minnaert.hpp"
#include "renderer/materials/oren_nayar.hpp"
#include "renderer/materials/phong.hpp"
#include "renderer/materials/registry.hpp"
#include "renderer/mesh_files/mesh_file.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <random>

namespace parameter_textures_test {

using namespace obscura;
using namespace obscura::renderer;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

/// A law, one of its parameters, and two values of it.
struct Case {
    scene::Material law;
    std::string parameter;
    double low, high;
};

const std::vector<Case>& cases() {
    const renderer::HapkeParameters hapke{0.4, 0.3, 0.6, 1.2, 0.05, 0.4, 0.08, 0.4, 0.3};
    static const std::vector<Case> all{
        {renderer::LunarLambertParameters{0.3, {1, -0.019, 2.42e-4, -1.46e-6}}, "weight", 0.1, 0.9},
        {renderer::MinnaertParameters{0.3, 0.7}, "exponent", 0.6, 1.5},
        {renderer::OrenNayarParameters{0.5, 0.3}, "slope", 0, 0.8},
        {renderer::PhongParameters{0.3, 0.3, 20}, "diffuse", 0.1, 0.7},
        {renderer::PhongParameters{0.3, 0.3, 20}, "specular", 0, 0.7},
        {renderer::PhongParameters{0.3, 0.3, 20}, "exponent", 2, 60},
        {hapke, "single_scattering_albedo", 0.1, 0.9},
        {hapke, "phase_b", 0.1, 0.6},
        {hapke, "phase_c", -0.8, 0.9},
        {hapke, "shadow_hiding_b0", 0, 3},
        {hapke, "shadow_hiding_h", 0.01, 0.3},
        {hapke, "backscatter_b0", 0, 2},
        {hapke, "backscatter_h", 0.01, 0.3},
        {hapke, "roughness", 0.1, 0.6},
        {hapke, "filling_factor", 0, 0.6},
        {renderer::GgxParameters{0.3, 0.04, 0.5}, "roughness", 0.1, 0.9},
        {renderer::GgxParameters{0.3, 0.04, 0.5}, "reflectance_f0", 0.02, 0.9},
        {renderer::GgxParameters{0.3, 0.04, 0.5}, "base_albedo", 0, 0.9},
    };
    return all;
}

std::size_t index_of(const Case& c) {
    const auto parameters = varying_parameters(c.law);
    for (std::size_t i = 0; i < parameters.size(); ++i)
        if (parameters[i].name == c.parameter) return i;
    FAIL("no parameter " << c.parameter);
    return 0;
}

/// A plate of 2 m in the x-y plane that faces +z, seen from aside under a Sun from the other, in radiance.
scene::Scene plate_scene(const TempFolder& folder, scene::Material law, int size) {
    scene::Scene s;
    s.bodies.push_back({"plate",
                        renderer::MeshFileParameters{
                            folder
                                .write("quad.obj", "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nv -1 -1 0\nv 1 -1 0\n"
                                                   "v 1 1 0\nv -1 1 0\nf 1/1 2/2 3/3 4/4\n")
                                .string(),
                            1, false},
                        std::move(law),
                        {}});
    s.sun.position_m = astronomical_unit_m * normalized(Vec3{0.1, 0.7, 0.6});
    s.quantity = scene::Quantity::radiance;
    s.camera = camera_at({0, -700, 700}, size, 2.0 / 1000 / size);
    s.camera.motion.samples[0].pose.orientation = look_along({0, 1, -1}, {0, 1, 1});
    s.camera.psf_sigma_px = 0;
    return s;
}

void set_texture(scene::Scene& s, const std::string& parameter, const std::string& file, double at_zero,
                 double at_one) {
    s.bodies[0].textures.parameters = {{parameter, file, at_zero, at_one}};
}

/// Eight texels across: four of 0, four of full scale.
std::string halves(const TempFolder& folder) {
    const std::vector<std::uint16_t> texels{0, 0, 0, 0, 65535, 65535, 65535, 65535};
    images::write_png16(folder.path() / "halves.png", 8, 1, 16, texels, {});
    return (folder.path() / "halves.png").string();
}

std::string refusal(const scene::Scene& s) {
    try {
        const renderer::Renderer r(s, {});
    } catch (const Error& e) {
        CHECK(std::string(e.what()).find('\n') == std::string::npos);
        return e.what();
    }
    return "accepted";
}

} // namespace

TEST_CASE("Each lane scatters as the law made with its own parameters does") {
    std::mt19937 random(7);
    const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
    for (const Case& c : cases()) {
        INFO(c.parameter);
        const std::size_t index = index_of(c);
        const auto mapped = make_material(c.law, "test");
        for (int packet = 0; packet < 20; ++packet) {
            ParameterPacket varied;
            const auto constants = varying_parameters(c.law);
            for (std::size_t k = 0; k < constants.size(); ++k)
                for (double& v : varied.value[k].v)
                    v = constants[k].value;
            ScatterPacket s;
            Vec3 in[packet_size];
            Vec3 out[packet_size];
            double value[packet_size];
            for (int i = 0; i < packet_size; ++i) {
                value[i] = c.low + (c.high - c.low) * uniform();
                varied.value[index][i] = value[i];
                for (Vec3* d : {&in[i], &out[i]}) {
                    const double z = 0.02 + 0.98 * uniform();
                    const double turn = 2 * std::numbers::pi * uniform();
                    const double across = std::sqrt(1 - z * z);
                    *d = {across * std::cos(turn), across * std::sin(turn), z};
                }
                s.cos_in[i] = in[i].z;
                s.cos_out[i] = out[i].z;
                s.cos_phase[i] = dot(in[i], out[i]);
            }
            s.varied = &varied;
            Doubles got;
            mapped->reflectance(s, got);
            s.varied = nullptr;
            for (int i = 0; i < packet_size; ++i) {
                scene::Material own = c.law;
                set_varying_parameter(own, index, value[i]);
                const auto law = make_material(own, "test");
                Doubles wanted;
                law->reflectance(s, wanted);
                REQUIRE_THAT(got[i], WithinRel(wanted[i], 1e-12));
                const double u = uniform();
                const double v = uniform();
                const Vec3 drawn = mapped->sample_varied(varied, i, out[i], u, v);
                REQUIRE(length(drawn - law->sample(out[i], u, v)) < 1e-12);
                REQUIRE_THAT(mapped->pdf_varied(varied, i, out[i], drawn),
                             WithinRel(law->pdf(out[i], drawn), 1e-12));
            }
        }
    }
}

TEST_CASE("A picture of two halves is half of each picture with a constant") {
    const TempFolder folder;
    constexpr int size = 16; // the whole plate
    const std::string file = halves(folder);
    for (const Case& c : cases()) {
        INFO(c.parameter);
        const std::size_t index = index_of(c);
        const auto constant = [&](double value) {
            scene::Material law = c.law;
            set_varying_parameter(law, index, value);
            return render(renderer::Renderer(plate_scene(folder, law, size), {}));
        };
        scene::Scene s = plate_scene(folder, c.law, size);
        set_texture(s, c.parameter, file, c.low, c.high);
        const Image got = render(renderer::Renderer(s, {}));
        // The path tracer, too: a lamp that gives nothing keeps the fast path out.
        scene::Lamp lamp;
        lamp.intensity_w_sr = {0};
        s.lamps.push_back(lamp);
        const Image traced = render(renderer::Renderer(s, {}));
        const Image low = constant(c.low);
        const Image high = constant(c.high);
        int different = 0;
        for (int y = 6; y < 10; ++y)
            for (int x = 1; x < size - 1; ++x) {
                if (x >= 6 && x < 10) continue; // where texels mix
                const float wanted = (x < 8 ? low : high).at(x, y);
                REQUIRE(wanted > 0);
                REQUIRE_THAT(got.at(x, y), WithinRel(wanted, 1e-6F));
                REQUIRE_THAT(traced.at(x, y), WithinRel(wanted, 1e-5F));
                different += std::abs(low.at(x, y) / high.at(x, y) - 1) > 1e-3F ? 1 : 0;
            }
        CHECK(different > 20);
    }
}

TEST_CASE("From afar a parameter is its mean over the pixel") {
    const TempFolder folder;
    std::mt19937 random(3);
    std::vector<std::uint16_t> texels(256 * 256);
    double mean = 0;
    for (auto& t : texels) {
        t = static_cast<std::uint16_t>(random() % 65536);
        mean += t / 65535.0 / static_cast<double>(texels.size());
    }
    images::write_png16(folder.path() / "noise.png", 256, 256, 16, texels, {});
    scene::Scene s = plate_scene(folder, renderer::OrenNayarParameters{0.5, 0.3}, 8);
    set_texture(s, "slope", (folder.path() / "noise.png").string(), 0.2, 0.7);
    const Image got = render(renderer::Renderer(s, {}));
    const Image wanted = render(
        renderer::Renderer(plate_scene(folder, renderer::OrenNayarParameters{0.5, 0.2 + 0.5 * mean}, 8), {}));
    // 32 x 32 texels in a pixel: their mean scatters by 0.009 of the range, the radiance by 0.3 %.
    for (int x = 1; x < 7; ++x)
        CHECK_THAT(got.at(x, 4), WithinRel(wanted.at(x, 4), 0.012F));
}

TEST_CASE("A closed room whose albedo a parameter gives is as bright as one of that albedo") {
    const TempFolder folder;
    const std::string file = halves(folder);
    scene::Scene s;
    s.sun.irradiance_scale = 0;
    s.quantity = scene::Quantity::radiance;
    s.camera = camera_at({0.3, -0.2, 0.1}, 8, 0.02);
    s.camera.psf_sigma_px = 0;
    s.bodies.push_back({"room", inward_cube(), renderer::PhongParameters{0.5, 0, 20}, {}});
    s.bodies[0].emission_w_m2_sr = {3.0};
    RenderSettings settings;
    settings.samples_per_pixel = 256;
    settings.max_bounces = 40;
    // The same albedo everywhere: the furnace. A Phong surface without highlight is Lambert's.
    set_texture(s, "diffuse", file, 0.5, 0.5);
    const double radiance = render(renderer::Renderer(s, settings)).sum() / 64;
    CHECK_THAT(radiance, WithinRel(3.0 / (1 - 0.5), 5e-3));
    // Two halves: as Lambert with the same texture on its albedo, draw by draw.
    set_texture(s, "diffuse", file, 0, 0.8);
    scene::Scene lambert = s;
    lambert.bodies[0].material = renderer::LambertParameters{0.8};
    lambert.bodies[0].textures = {};
    lambert.bodies[0].textures.albedo = file;
    CHECK_THAT(render(renderer::Renderer(s, settings)).sum(),
               WithinRel(render(renderer::Renderer(lambert, settings)).sum(), 1e-3));
}

TEST_CASE("Texels that a law does not allow, and parameters that it has not, are refused in one line") {
    const TempFolder folder;
    const std::string file = halves(folder);
    scene::Scene s = plate_scene(folder, renderer::OrenNayarParameters{0.5, 0.3}, 8);
    set_texture(s, "slope", file, 0, 1.5);
    CHECK_THAT(refusal(s),
               ContainsSubstring("body 'plate', largest texels of its parameters: slope 1.49999"));
    CHECK_THAT(refusal(s), ContainsSubstring(": allowed 0 to 1"));
    set_texture(s, "slope", file, 0.2, -0.1);
    CHECK_THAT(refusal(s), ContainsSubstring("least texels of its parameters: slope -0.0999"));
    set_texture(s, "exponent", file, 0, 1);
    CHECK(refusal(s) == "body 'plate': no texture can give its material's exponent: allowed albedo, slope");
    s = plate_scene(folder, renderer::LambertParameters{0.5}, 8);
    set_texture(s, "roughness", file, 0, 1);
    CHECK(refusal(s) == "body 'plate': no texture can give its material's roughness: allowed albedo");
    // Energy: diffuse and specular together, at their largest.
    s = plate_scene(folder, renderer::PhongParameters{0.3, 0.3, 20}, 8);
    set_texture(s, "diffuse", file, 0, 0.8);
    CHECK_THAT(refusal(s), ContainsSubstring("largest texels of its parameters: specular 0.3: allowed 0 to"));
    const std::vector<float> cube(8 * 3, 0.5F);
    images::write_fits_float(folder.path() / "cube.fits", 4, 2, 3, cube, "", {});
    set_texture(s, "diffuse", (folder.path() / "cube.fits").string(), 0, 0.5);
    CHECK_THAT(refusal(s), ContainsSubstring("cube.fits: 3 planes: the diffuse of body 'plate' needs 1"));
}

} // namespace parameter_textures_test
