// SPDX-License-Identifier: Apache-2.0
// Point spread functions written in SuMoL against closed forms and the built-in ones, and how scenes name
// them.
#include "config/shipped_files.hpp"
#include "core/error.hpp"
#include "models/kinds/psf_program.hpp"
#include "renderer/camera/psf.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "renderer/world/model_warnings.hpp"
#include "scene_texts.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

namespace model_psf_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;

namespace {

/// A sphere and two bands; f/8, lambda N is 1.2 px at 550 nm.
std::string scene_text(const std::string& psf, const std::string& camera = "") {
    return fmt::format(R"(
[sun]
position_m = [1.2e11, 0.6e11, 0.5e11]
[camera]
width = 96
height = 64
pixel_pitch_um = 3.6666667
focal_length_mm = 80
aperture_mm = 10
position_m = [10000, 0, 0]
boresight = [-1, 0, 0]
{}
psf = {}
[[band]]
from_nm = 440
to_nm = 500
[[band]]
from_nm = 700
to_nm = 800
[[body]]
shape = "ellipsoid"
radii_m = [8, 8, 8]
albedo = 0.2
)",
                       camera, psf);
}

std::unique_ptr<const renderer::Psf> psf_of(scene::Scene& scene) {
    return renderer::Psf::make(scene.camera, scene.bands);
}

std::vector<float> picture(const scene::Scene& scene, std::uint32_t threads) {
    renderer::RenderSettings options;
    options.threads = threads;
    return render_window(renderer::Renderer(scene, options), {0, 0, 96, 64});
}

std::string refusal_of_psf(const SceneTexts& folder, const std::string& psf, const std::string& camera = "") {
    try {
        scene::Scene scene = folder.scene(scene_text(psf, camera));
        (void)psf_of(scene);
    } catch (const Error& error) {
        std::string what = error.what();
        const std::string prefix = folder.path().string() + "/";
        while (what.find(prefix) != std::string::npos)
            what.erase(what.find(prefix), prefix.size());
        return what;
    }
    return "accepted";
}

} // namespace

TEST_CASE("a Gaussian in SuMoL brings into each pixel what the error function says") {
    const SceneTexts folder;
    constexpr double sigma = 1.1, x = 40.3, y = 30.9;
    scene::Scene scene =
        folder.scene(scene_text("{ model = \"gaussian\", sigma_long = 1.1, sigma_short = 1.1 }"));
    const auto psf = psf_of(scene);
    REQUIRE(psf != nullptr);
    CHECK_FALSE(psf->chromatic());
    CHECK(psf->zones() == 1);
    const auto share = [](double d) {
        const double scale = sigma * std::numbers::sqrt2;
        return (std::erf((d + 0.5) / scale) - std::erf((d - 0.5) / scale)) / 2;
    };
    double sum = 0;
    for (int row = 10; row < 52; ++row)
        for (int column = 20; column < 62; ++column) {
            const double given = psf->weight({x, y}, column, row, 0);
            const double peak = share(0) * share(0);
            // Tables are means over, and linear between, points an eighth of a pixel apart.
            CHECK_THAT(given, WithinAbs(share(column - x) * share(row - y), 6e-3 * peak));
            sum += given;
        }
    CHECK_THAT(sum, WithinAbs(1, 1e-6));
}

TEST_CASE("diffraction in SuMoL is the built-in one: tables, colours and picture") {
    const SceneTexts folder;
    const std::string wings = "psf_core_px = 12\npsf_wings_px = 40\npsf_obscuration = 0.3";
    scene::Scene built_in = folder.scene(scene_text("\"airy\"", wings));
    scene::Scene model = folder.scene(scene_text("{ model = \"airy\", obscuration = 0.3 }", wings));
    const auto a = psf_of(built_in), b = psf_of(model);
    CHECK(b->chromatic());
    for (const std::size_t band : {0U, 1U}) {
        const double peak = a->weight({40.3, 30.9}, 40, 31, band);
        for (int row = 20; row < 42; ++row)
            for (int column = 30; column < 52; ++column)
                CHECK_THAT(b->weight({40.3, 30.9}, column, row, band),
                           WithinAbs(a->weight({40.3, 30.9}, column, row, band), 2e-4 * peak));
        for (const double r2 : {200.0, 600.0, 1500.0})
            CHECK_THAT(b->wing(std::size_t{0}, band, r2), WithinAbs(a->wing(std::size_t{0}, band, r2), 1e-7));
    }
    const std::vector<float> expected = picture(built_in, 1), given = picture(model, 1);
    const float largest = *std::max_element(expected.begin(), expected.end());
    // The built-in function is a table of its radius, so that displacements differ by some 1e-4 px: on the
    // limb a few samples fall on its other side.
    double sum = 0, sum_given = 0;
    std::size_t elsewhere = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
        sum += static_cast<double>(expected[i]);
        sum_given += static_cast<double>(given[i]);
        const double difference = static_cast<double>(std::abs(given[i] - expected[i]) / largest);
        CHECK(difference < 0.02);
        elsewhere += difference > 1e-3 ? 1 : 0;
    }
    CHECK(sum > 0);
    CHECK_THAT(sum_given / sum, WithinAbs(1, 1e-4));
    CHECK(elsewhere <= expected.size() / 100);
}

TEST_CASE("a picture with a point spread in SuMoL is the same on any number of threads") {
    const SceneTexts folder;
    const scene::Scene scene = folder.scene(scene_text("{ model = \"moffat\", fwhm = 2.5 }"));
    const std::vector<float> one = picture(scene, 1);
    CHECK(picture(scene, 2) == one);
    CHECK(picture(scene, 7) == one);
}

TEST_CASE("machine code and interpreter give the same bits of a point spread") {
    for (const char* name : {"airy", "moffat", "gaussian", "asymmetric"}) {
        const auto loaded = models::load_model(
            (config::shipped_data_folder() / "models" / fmt::format("{}.psf", name)).string(), "psf");
        models::ModelParameters parameters = models::program_parameters(models::defaults_of(loaded));
        const models::PsfProgram native(loaded->model, parameters);
        parameters.target = models::NativeTarget::none;
        const models::PsfProgram interpreted(loaded->model, parameters);
        std::vector<double> x, y, a(1000), b(1000);
        for (int i = 0; i < 1000; ++i) {
            x.push_back(20 * std::cos(i));
            y.push_back(20 * std::sin(1.3 * i));
        }
        const models::PsfConditions conditions{600e-9, 300, -200, 5e-6, 7};
        native.density(conditions, x, y, a);
        interpreted.density(conditions, x, y, b);
        CHECK(a == b);
    }
}

TEST_CASE("a tail that grows with the field moves the centroid by what its two halves say") {
    const SceneTexts folder;
    scene::Scene scene =
        folder.scene(scene_text("{ model = \"asymmetric\", sigma = 0.9, growth = 10 }", "psf_core_px = 12"));
    const auto psf = psf_of(scene);
    CHECK(psf->zones() == 25);
    const std::vector<double> weights(2, 1.0);
    // Mean of two half Gaussians: sqrt(2 / pi) (outer - inner).
    const double field = std::hypot(47.5, 31.5);
    const double expected = std::sqrt(2 / std::numbers::pi) * 0.9 * 10 * field / 1000;
    const renderer::ImagePoint at = psf->centroid({95, 63}, weights);
    CHECK_THAT(at.x, WithinAbs(expected * 47.5 / field, 1e-3));
    CHECK_THAT(at.y, WithinAbs(expected * 31.5 / field, 1e-3));
    const renderer::ImagePoint middle = psf->centroid({47.5, 31.5}, weights);
    CHECK_THAT(std::hypot(middle.x, middle.y), WithinAbs(0, 1e-9));
    const std::vector<std::string> said = renderer::model_warnings(scene);
    REQUIRE(said.size() == 4);
    CHECK_THAT(said[0], ContainsSubstring("centroid") && ContainsSubstring("for points at (0, 0) px"));
}

TEST_CASE("mistakes in a point spread are told with their places") {
    const SceneTexts folder;
    folder.write("negative.psf", "scalar density(vec2 p, scalar wavelength) { return 0.2 - (p | p); }");
    folder.write("nan.psf", "scalar density(vec2 p, scalar wavelength) { return sqrt(p.x - 3); }");
    folder.write("wide.psf", "scalar density(vec2 p, scalar wavelength) { return 1e-4; }");
    folder.write("half.psf",
                 "scalar density(vec2 p, scalar wavelength) { return exp(-(p | p)) / M_PI * 0.9; }");
    folder.write("other.psf", "scalar density(vec3 p, scalar wavelength) { return 1; }");
    CHECK_THAT(refusal_of_psf(folder, "{ model = \"negative.psf\" }"),
               ContainsSubstring("camera: psf: negative.psf: density() is negative at ("));
    CHECK_THAT(refusal_of_psf(folder, "{ model = \"nan.psf\" }"),
               ContainsSubstring("density() is not finite at ("));
    CHECK_THAT(refusal_of_psf(folder, "{ model = \"wide.psf\" }"),
               ContainsSubstring("only 0.0804 of the light is within the core of 16 px"));
    CHECK_THAT(
        refusal_of_psf(folder, "{ model = \"other.psf\" }"),
        ContainsSubstring("other.psf:1:8: 'density' must be scalar density(vec2 p, scalar wavelength [, "));
    CHECK_THAT(refusal_of_psf(folder, "{ model = \"half.psf\", sigma = 1 }"),
               ContainsSubstring("s.toml:13:29: camera.psf.sigma: unknown key"));
    CHECK_THAT(refusal_of_psf(folder, "\"model\""),
               ContainsSubstring("write psf = { model = \"FILE.psf\" }"));
    CHECK_THAT(refusal_of_psf(folder, "{ model = \"hapke.brdf\" }"), ContainsSubstring("no such file"));
    CHECK_THAT(refusal_of_psf(folder, "{ model = \"moffet\" }"),
               ContainsSubstring("no shipped PSF model") && ContainsSubstring("did you mean \"moffat\"?"));
    CHECK_THAT(refusal_of_psf(folder, "{ model = \"half.psf\" }", "psf_defocus_um = 20"),
               ContainsSubstring("a model cannot be defocused"));
    CHECK(refusal_of_psf(folder, "{ model = \"half.psf\" }") == "accepted");
    const std::vector<std::string> said =
        renderer::model_warnings(folder.scene(scene_text("{ model = \"half.psf\" }")));
    REQUIRE(said.size() == 1);
    CHECK_THAT(said[0], ContainsSubstring("the integral of density() within 16 px is 0.9, not 1"));
}

} // namespace model_psf_test
