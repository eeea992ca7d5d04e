// SPDX-License-Identifier: Apache-2.0
#include "tools/model/material_tools.hpp"

#include "images/writers/raw.hpp"
#include "models/kinds/material_checks.hpp"
#include "renderer/materials/hapke.hpp"
#include "renderer/materials/model_material.hpp"
#include "renderer/materials/registry.hpp"
#include "tools/model/law_angles.hpp"
#include "tools/model/law_pictures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::tools {
namespace {

constexpr std::string_view new_material = R"(// {0}: a scattering law in SuMoL.
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

/// Bands that show all channels of a law.
std::size_t bands_of(const models::ModelValues& p) {
    std::size_t bands = 4;
    for (const std::vector<double>& channels : p.channels)
        bands = std::max(bands, channels.size());
    return std::min(bands, models::MaterialProgram::max_bands);
}

renderer::ModelMaterial law_of(const models::ModelValues& p) {
    return renderer::ModelMaterial({{p}, bands_of(p)});
}

models::MaterialProgram law_program(const models::ModelValues& p) {
    models::MaterialParameters parameters{models::program_parameters(p)};
    parameters.shininess = p.shininess;
    parameters.bands = bands_of(p);
    return {p.loaded->model, parameters};
}

ModelCost cost(const models::ModelValues& p) {
    const models::MaterialProgram law = law_program(p);
    ModelCost cost = cost_of(law.program(), law.why_interpreted());
    cost.facts.push_back({"colours",
                          law.is_proportional_to_diffuse()
                              ? "factors on the result"
                              : "not allowed: the result is not proportional to `diffuse`",
                          "proportional_to_diffuse", law.is_proportional_to_diffuse()});
    return cost;
}

ModelVerdict check(const models::ModelValues& p) {
    const models::MaterialProgram law = law_program(p);
    const models::MaterialReport report = models::report_on(law);
    ModelVerdict verdict{
        p.loaded->model->function("brdf")->at, models::refusal_by(report, false),
        models::warnings_by(report, false),
        fmt::format("{} operations a sample, reflects at most {:.4g} of the light, at incidence {:.0f} deg",
                    law.program().cost(), report.largest_albedo, report.largest_albedo_at_deg)};
    const renderer::ModelMaterialParameters parameters{{p}, bands_of(p)};
    if (const auto emission = renderer::law_emission(parameters, {1}, false)) {
        const models::EmissionReport own =
            models::report_on_emission(*emission, std::vector<double>(emission->rows(), 0.5));
        if (verdict.refusal.empty()) verdict.refusal = models::refusal_by(own);
        if (const std::string line = models::warning_by(own); !line.empty()) verdict.warnings.push_back(line);
    }
    return verdict;
}

ModelFacts eval(const models::ModelValues& p, const ModelPoint& at) {
    const LawAngles angles{at.at("incidence"), at.at("emission"), at.at("azimuth")};
    const renderer::ModelMaterial law = law_of(p);
    const double r = law_values(law, {angles.cosines()})[0];
    const double factor = std::numbers::pi * r;
    ModelFacts facts{
        {"phase angle", fmt::format("{:.6g} deg", angles.phase_deg()), "phase_deg", angles.phase_deg()},
        {"BRDF x cos i", fmt::format("{:.12g} 1/sr", r), "r_per_sr", r},
        {"radiance factor", fmt::format("{:.12g}", factor), "radiance_factor", factor}};
    if (!law.spectral()) return facts;
    renderer::Channels r_of;
    law.reflectances(packets_of({angles.cosines()})[0], r_of);
    std::vector<double> channels;
    for (std::size_t c = 0; c < bands_of(p); ++c)
        channels.push_back(r_of.v[c][0]);
    facts.push_back({"in each channel", fmt::format("{:.12g} 1/sr", fmt::join(channels, ", ")),
                     "r_per_sr_of_channels", channels});
    return facts;
}

void plot(const models::ModelValues& p, std::string_view title, const std::filesystem::path& file) {
    const renderer::ModelMaterial law = law_of(p);
    if (file.extension() == ".png")
        law_spheres(law).write(file);
    else if (file.extension() == ".svg")
        images::write_text(file, law_svg(law, title));
    else
        images::write_text(file, law_csv(law));
}

double law_nanoseconds(const renderer::Material& law) {
    constexpr int packets = 64;
    constexpr int samples = packets * renderer::packet_size;
    std::vector<LawCosines> directions;
    for (int i = 0; i < samples; ++i) {
        const double share = (i + 0.5) / samples;
        directions.push_back(
            LawAngles{80 * share, 80 * std::fmod(share * 37, 1.0), 180 * std::fmod(share * 91, 1.0)}
                .cosines());
    }
    const std::vector<renderer::ScatterPacket> in = packets_of(directions);
    volatile double sink = 0;
    const double best = nanoseconds_a_sample(20.0 * samples, [&] {
        renderer::Doubles r;
        double sum = 0;
        for (int k = 0; k < 20 * packets; ++k) {
            law.reflectance(in[static_cast<std::size_t>(k % packets)], r);
            sum += r[0];
        }
        sink = sum;
    });
    (void)sink;
    return best;
}

ModelFacts bench(const models::ModelValues& p) {
    const auto fact = [](std::string label, std::string name, double ns) {
        return ModelFact{std::move(label), fmt::format("{:8.2f}", ns), std::move(name), ns};
    };
    ModelFacts facts{fact("", "model_ns", law_nanoseconds(law_of(p)))};
    for (const std::string_view name : {"lambert", "lommel-seeliger", "minnaert", "oren-nayar", "hapke"}) {
        const auto& kinds = renderer::material_kinds();
        scene::Material description = scene::find_kind(kinds, name)->make_default();
        // A smooth surface would be another law.
        if (auto* const hapke = description.get_if<renderer::HapkeParameters>()) hapke->roughness_rad = 0.35;
        const double ns = law_nanoseconds(*renderer::make_material(description, "bench"));
        facts.push_back(fact(fmt::format("built-in {}", name), std::string(name), ns));
    }
    return facts;
}

} // namespace

const KindTools& material_tools() {
    static const KindTools tools{
        "material",
        new_material,
        cost,
        check,
        {{"incidence", "deg", "Angle between light and normal", 0, 0, 90},
         {"emission", "deg", "Angle between camera and normal", 0, 0, 90},
         {"azimuth", "deg", "Angle between their planes; 0: light and camera on one side", 0, 0, 180}},
        eval,
        {{".png", "spheres of the law at phase angles of 5, 30, 60 and 100 degrees"},
         {".svg",
          "lobes in the plane of incidence for light at 0, 30 and 60 degrees, and the phase curve of a sphere"},
         {".csv", "a table over incidence, emission and azimuth"}},
        plot,
        bench};
    return tools;
}

} // namespace obscura::tools
