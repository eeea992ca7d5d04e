// SPDX-License-Identifier: Apache-2.0
#include "renderer/materials/model_material.hpp"

#include "core/error.hpp"
#include "models/kinds/material_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace obscura::renderer {
namespace {

/// Parameters that an image may give, as indices in Model::parameters(): as many as a packet holds.
std::vector<std::size_t> image_parameters(const models::Model& model) {
    std::vector<std::size_t> indices;
    // Textures first: they have no constant that could stand for them.
    for (const bool textures : {true, false})
        for (std::size_t i = 0; i < model.parameters().size(); ++i) {
            const models::Parameter& p = model.parameters()[i];
            const bool texture = p.type == models::Type::texture;
            const bool number = p.type == models::Type::scalar || p.type == models::Type::vec4;
            if (texture == textures && (texture || number) && !p.global && indices.size() < max_parameters)
                indices.push_back(i);
        }
    std::sort(indices.begin(), indices.end());
    return indices;
}

models::MaterialParameters law_parameters(const ModelMaterialParameters& p, std::vector<std::size_t> varied) {
    if (p.loaded == nullptr)
        throw ConfigError(
            "material: the model's file is missing: write material = { model = \"FILE.brdf\" }");
    models::MaterialParameters parameters{scene::program_parameters(p)};
    parameters.varied = std::move(varied);
    parameters.shininess = p.shininess;
    return parameters;
}

} // namespace

ModelMaterialParameters load_material_model(const std::string& file) {
    return {scene::defaults_of(scene::load_model(file, "material"))};
}

scene::ParameterList declare(ModelMaterialParameters& p) {
    scene::ParameterList list;
    if (p.loaded == nullptr) return list;
    const models::Model& model = *p.loaded->model;
    const std::vector<std::size_t> by_image = image_parameters(model);
    for (std::size_t i = 0; i < model.parameters().size(); ++i) {
        if (model.parameters()[i].global) continue;
        config::Key key = parameter_key(p, i);
        const bool image = std::find(by_image.begin(), by_image.end(), i) != by_image.end();
        list.push_back(image ? scene::image_or(std::move(key)) : scene::Parameter(std::move(key)));
    }
    list.push_back(shininess_key(p));
    return list;
}

ModelMaterial::ModelMaterial(const ModelMaterialParameters& p)
    : same_(p.loaded != nullptr ? p.loaded->model : nullptr, law_parameters(p, {})),
      varied_(p.loaded->model, law_parameters(p, image_parameters(*p.loaded->model))) {}

void ModelMaterial::reflectance(const ScatterPacket& s, Doubles& r) const {
    Doubles cos_out;
    for (int i = 0; i < packet_size; ++i)
        cos_out[i] = s.cos_out[i] > 1e-9 ? s.cos_out[i] : 1e-9;
    std::array<const double*, max_parameters> rows{};
    if (s.varied != nullptr)
        for (std::size_t k = 0; k < rows.size(); ++k)
            rows[k] = s.varied->value[k].v;
    const models::MaterialProgram& law = s.varied != nullptr ? varied_ : same_;
    law.evaluate(s.cos_in.v, cos_out.v, s.cos_phase.v, rows.data(), r.v, packet_size);
    for (int i = 0; i < packet_size; ++i)
        r[i] = s.cos_in[i] > 0 && r[i] > 0 && r[i] < 1e6 ? r[i] : 0.0;
}

std::vector<std::string> model_material_warnings(const scene::Scene& scene) {
    std::vector<std::string> lines;
    for (const scene::Body& body : scene.bodies) {
        const auto* const p = body.material.get_if<ModelMaterialParameters>();
        if (p == nullptr || p->loaded == nullptr) continue;
        const models::MaterialProgram law(p->loaded->model, law_parameters(*p, {}));
        for (const std::string& line : models::warnings_by(models::report_on(law), scene.max_bounces > 0))
            lines.push_back(fmt::format("\"{}\": {}: {}", body.name, p->loaded->model->name(), line));
        if (const std::string& text = p->loaded->model->warnings(); !text.empty()) lines.push_back(text);
    }
    return lines;
}

void check_model_material(const scene::Scene& scene, const scene::Body& body, const std::string& place) {
    const auto* const p = body.material.get_if<ModelMaterialParameters>();
    if (p == nullptr) return;
    const models::MaterialProgram law(p->loaded != nullptr ? p->loaded->model : nullptr,
                                      law_parameters(*p, {}));
    const auto refuse = [&](std::string_view what) {
        throw ConfigError(fmt::format("{}: {}: {}", place, law.model().name(), what));
    };
    const std::string why = models::refusal_by(models::report_on(law), scene.max_bounces > 0);
    if (!why.empty()) refuse(why);
    const bool coloured = !body.colour.empty() && std::any_of(body.colour.begin(), body.colour.end(),
                                                              [](double c) { return c != 1; });
    if ((coloured || !body.textures.albedo.empty()) && !law.is_proportional_to_diffuse())
        refuse(
            "the body has a colour or an albedo texture, and brdf() is not proportional to `diffuse`, which they "
            "are: multiply the result by diffuse, or leave them out");
}

} // namespace obscura::renderer
