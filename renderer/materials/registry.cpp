// SPDX-License-Identifier: Apache-2.0
#include "renderer/materials/registry.hpp"

#include "core/error.hpp"
#include "renderer/materials/file_materials.hpp"
#include "renderer/materials/ggx.hpp"
#include "renderer/materials/hapke.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/materials/lommel_seeliger.hpp"
#include "renderer/materials/lunar_lambert.hpp"
#include "renderer/materials/minnaert.hpp"
#include "renderer/materials/mirror.hpp"
#include "renderer/materials/model_material.hpp"
#include "renderer/materials/oren_nayar.hpp"
#include "renderer/materials/phase_curve.hpp"
#include "renderer/materials/phong.hpp"
#include "renderer/materials/planet_presets.hpp"
#include "renderer/materials/presets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace obscura::renderer {
namespace {

template<typename Law>
MaterialKind law() {
    using P = typename Law::Parameters;
    return {scene::kind_of<P>(), [](const scene::Material& d) -> std::unique_ptr<Material> {
                return std::make_unique<Law>(d.get<P>());
            }};
}

const std::vector<MaterialKind>& laws() {
    // clang-format off
    static const std::vector<MaterialKind> kinds{
        law<Lambert>(),
        law<LommelSeeliger>(),
        law<LunarLambert>(),
        law<Minnaert>(),
        law<OrenNayar>(),
        law<Phong>(),
        law<Hapke>(),
        law<PhaseCurve>(),
        law<Ggx>(),
        law<Mirror>(),
        law<FileMaterials>(),
        law<ModelMaterial>(),
    };
    // clang-format on
    return kinds;
}

/// Preset: a real surface by name, with the keys of its law.
MaterialKind preset(std::string_view name, std::string_view help, scene::Material (*parameters)(),
                    const PresetRange& range, std::vector<SpectralPoint> albedo_curve = {}) {
    MaterialKind kind = *find_kind(laws(), parameters().kind());
    kind.name = name;
    kind.help = help;
    kind.make_default = parameters;
    kind.preset = true;
    kind.range = range;
    kind.albedo_curve = std::move(albedo_curve);
    return kind;
}

/// Preset of a planet or moon: its range is that of its colours, and of its phase curve or, where that goes
/// on beyond what was measured, `measured_to_deg`.
MaterialKind planet(std::string_view name, std::string_view help, scene::Material (*parameters)(),
                    std::vector<SpectralPoint> colour_curve, std::string_view source,
                    double measured_to_deg = 180) {
    const scene::Material material = parameters();
    const double last_deg = material.get<PhaseCurveParameters>().phase_deg.back();
    MaterialKind kind = preset(name, help, parameters,
                               {.from_nm = colour_curve.front().wavelength_m * 1e9,
                                .to_nm = colour_curve.back().wavelength_m * 1e9,
                                .to_deg = std::min(last_deg, measured_to_deg),
                                .source = source});
    kind.colour_curve = std::move(colour_curve);
    return kind;
}

// Passband V: Bessell, PASP 102, 1181 (1990).
constexpr double v_from_nm = 470, v_to_nm = 700;
// Absorptances are those of the whole of sunlight.
constexpr PresetRange sunlight{.from_nm = 250, .to_nm = 2500, .source = "solar absorptance"};

std::vector<MaterialKind> presets() {
    constexpr std::string_view mallama = "Mallama and Hilton 2018, Mallama et al. 2017";
    constexpr std::string_view harris = "Harris 1961, Morrison and Morrison 1977";
    constexpr double moons_to_deg = 12;
    return {
        preset("moon", "The Moon, average surface: Hapke's model.", moon,
               {.from_nm = v_from_nm,
                .to_nm = v_to_nm,
                .from_deg = 2,
                .to_deg = 120,
                .source = "V: Kieffer and Stone 2005, Allen"}),
        preset("eros", "Asteroid 433 Eros: Hapke's model, w by the spectrum of its class.", eros,
               {.from_nm = 450, .to_nm = 1050, .source = "Li 2005, NEAR MSI"}, s_class_curve()),
        preset("itokawa", "Asteroid 25143 Itokawa: Hapke's model.", itokawa,
               {.from_nm = v_from_nm, .to_nm = v_to_nm, .source = "albedo in V: Tatsumi et al. 2018"}),
        preset("67p", "Nucleus of comet 67P/Churyumov-Gerasimenko: Hapke's model.", comet_67p,
               {.from_nm = 607, .to_nm = 691, .source = "OSIRIS filter F22: Fornasier et al. 2015"}),
        planet("mercury", "Mercury: measured phase curve, and colour.", mercury, mercury_curve(), mallama),
        planet("venus", "Venus, its clouds: measured phase curve, and colour.", venus, venus_curve(),
               mallama),
        planet("earth", "The Earth from afar, clouds included: measured phase curve, and colour.", earth,
               earth_curve(), "Mallama et al. 2017"),
        planet("mars", "Mars: measured phase curve, and colour.", mars, mars_curve(), mallama),
        planet("jupiter", "Jupiter: measured phase curve, and colour.", jupiter, jupiter_curve(),
               "Mallama et al. 2017, Mayorga et al. 2016"),
        planet("saturn", "Saturn without its rings: measured phase curve, and colour.", saturn,
               saturn_curve(), "Mallama et al. 2017, Dyudina et al. 2005"),
        planet("io", "Io, a moon of Jupiter: phase curve measured to 12 degrees, and colour.", io, io_curve(),
               harris, moons_to_deg),
        planet("europa", "Europa, a moon of Jupiter: phase curve measured to 12 degrees, and colour.", europa,
               europa_curve(), harris, moons_to_deg),
        planet("ganymede", "Ganymede, a moon of Jupiter: phase curve measured to 12 degrees, and colour.",
               ganymede, ganymede_curve(), harris, moons_to_deg),
        planet("callisto", "Callisto, a moon of Jupiter: phase curve measured to 12 degrees, and colour.",
               callisto, callisto_curve(), harris, moons_to_deg),
        preset("mli", "Multi-layer insulation, aluminised Kapton: GGX metal.", mli, sunlight),
        preset("solar-cell", "Solar cell under cover glass: GGX dielectric over a diffuse base.", solar_cell,
               sunlight),
        preset("white-paint", "White paint of spacecraft: Lambert's law.", white_paint, sunlight),
    };
}

const MaterialKind& law_of(const scene::Material& material, const std::string& place) {
    const MaterialKind* kind = find_kind(laws(), material.kind());
    if (kind == nullptr) throw ConfigError(fmt::format("{}: has no material", place));
    return *kind;
}

/// The first coefficient of a parameter that an image may give.
double& first_of(const config::Target& target) {
    if (const auto* scaled = std::get_if<config::Scaled>(&target)) return *scaled->value;
    if (const auto* numbers = std::get_if<config::Numbers>(&target)) return *numbers->first;
    return *std::get<double*>(target);
}

/// Parameters of `material` that an image may give.
scene::ParameterList varying(scene::Material& material) {
    scene::ParameterList parameters = law_of(material, "texture").parameters(material);
    parameters.erase(std::remove_if(parameters.begin(), parameters.end(),
                                    [](const scene::Parameter& p) { return !p.image; }),
                     parameters.end());
    if (parameters.size() > max_parameters)
        throw std::logic_error(fmt::format("{} has more than {} parameters that an image may give",
                                           material.kind(), max_parameters));
    return parameters;
}

} // namespace

const std::vector<MaterialKind>& material_kinds() {
    static const std::vector<MaterialKind> kinds = [] {
        std::vector<MaterialKind> all = laws();
        const std::vector<MaterialKind> real = presets();
        all.insert(all.end(), real.begin(), real.end());
        return all;
    }();
    return kinds;
}

std::string text_of(const PresetRange& range) {
    std::string text = fmt::format("from {:.0f} to {:.0f} nm", range.from_nm, range.to_nm);
    if (range.from_deg > 0 || std::isfinite(range.to_deg))
        text += fmt::format(", at phase angles of {:.3g} to {:.3g} deg", range.from_deg, range.to_deg);
    return text;
}

std::unique_ptr<Material> make_material(const scene::Material& description, const std::string& place) {
    const MaterialKind& kind = law_of(description, place);
    check_description(kind, description, place);
    return kind.make(description);
}

double normal_albedo(const scene::Material& description) {
    const std::unique_ptr<Material> material = law_of(description, "normal albedo").make(description);
    ScatterPacket s;
    for (int i = 0; i < packet_size; ++i)
        s.cos_in[i] = s.cos_out[i] = s.cos_phase[i] = 1;
    Doubles r;
    material->reflectance(s, r);
    return std::numbers::pi * r[0];
}

std::vector<VaryingParameter> varying_parameters(const scene::Material& material) {
    scene::Material copy = material;
    std::vector<VaryingParameter> out;
    for (const scene::Parameter& parameter : varying(copy))
        out.push_back({scene::quantity_of(parameter.key), first_of(parameter.key.target)});
    return out;
}

void set_varying_parameter(scene::Material& material, std::size_t index, double value) {
    const scene::ParameterList parameters = varying(material);
    const config::Target& target = parameters.at(index).key.target;
    if (const auto* numbers = std::get_if<config::Numbers>(&target))
        std::fill_n(numbers->first, numbers->count, 0.0);
    first_of(target) = value;
}

} // namespace obscura::renderer
