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
#include "renderer/materials/oren_nayar.hpp"
#include "renderer/materials/phase_curve.hpp"
#include "renderer/materials/phong.hpp"
#include "renderer/materials/planet_presets.hpp"
#include "renderer/materials/presets.hpp"

#include <fmt/format.h>

#include <algorithm>
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
    };
    // clang-format on
    return kinds;
}

/// Preset: a real surface by name, with the keys of its law.
MaterialKind preset(std::string_view name, std::string_view help, scene::Material (*parameters)(),
                    std::vector<SpectralPoint> colour_curve = {}) {
    MaterialKind kind = *find_kind(laws(), parameters().kind());
    kind.name = name;
    kind.help = help;
    kind.make_default = parameters;
    kind.preset = true;
    kind.colour_curve = std::move(colour_curve);
    return kind;
}

std::vector<MaterialKind> presets() {
    return {
        preset("moon", "The Moon, average surface: Hapke's model.", moon),
        preset("eros", "Asteroid 433 Eros: Hapke's model, and a spectrum of its class.", eros,
               s_class_curve()),
        preset("itokawa", "Asteroid 25143 Itokawa: Hapke's model.", itokawa),
        preset("67p", "Nucleus of comet 67P/Churyumov-Gerasimenko: Hapke's model.", comet_67p),
        preset("mercury", "Mercury: measured phase curve, and colour.", mercury, mercury_curve()),
        preset("venus", "Venus, its clouds: measured phase curve, and colour.", venus, venus_curve()),
        preset("earth", "The Earth from afar, clouds included: measured phase curve, and colour.", earth,
               earth_curve()),
        preset("mars", "Mars: measured phase curve, and colour.", mars, mars_curve()),
        preset("jupiter", "Jupiter: measured phase curve, and colour.", jupiter, jupiter_curve()),
        preset("saturn", "Saturn without its rings: measured phase curve, and colour.", saturn,
               saturn_curve()),
        preset("io", "Io, a moon of Jupiter: phase curve measured to 12 degrees, and colour.", io,
               io_curve()),
        preset("europa", "Europa, a moon of Jupiter: phase curve measured to 12 degrees, and colour.", europa,
               europa_curve()),
        preset("ganymede", "Ganymede, a moon of Jupiter: phase curve measured to 12 degrees, and colour.",
               ganymede, ganymede_curve()),
        preset("callisto", "Callisto, a moon of Jupiter: phase curve measured to 12 degrees, and colour.",
               callisto, callisto_curve()),
        preset("mli", "Multi-layer insulation, aluminised Kapton: GGX metal.", mli),
        preset("solar-cell", "Solar cell under cover glass: GGX dielectric over a diffuse base.", solar_cell),
        preset("white-paint", "White paint of spacecraft: Lambert's law.", white_paint),
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
