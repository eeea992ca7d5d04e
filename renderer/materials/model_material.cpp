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
    for (std::size_t i = 0; i < model.parameters().size(); ++i) {
        const models::Parameter& p = model.parameters()[i];
        const bool number = p.type == models::Type::scalar || p.type == models::Type::vec4;
        if (number && !p.global && indices.size() < max_parameters) indices.push_back(i);
    }
    return indices;
}

/// Rows of a law where nothing varies: the reads of each texture give its mean.
std::vector<double> constant_rows(const models::MaterialProgram& law, const ModelMaterialParameters& p) {
    std::vector<double> rows(law.rows(), 0);
    rows[law.row(models::SurfaceRow::u)] = rows[law.row(models::SurfaceRow::v)] = 0.5;
    for (std::size_t k = 0; k < law.reads().size(); ++k)
        std::copy_n(p.values[law.reads()[k].texture].begin(), 4,
                    rows.begin() + static_cast<std::ptrdiff_t>(law.first_read_row() + 4 * k));
    return rows;
}

models::MaterialParameters law_parameters(const ModelMaterialParameters& p, std::vector<std::size_t> varied) {
    if (p.loaded == nullptr)
        throw ConfigError(
            "material: the model's file is missing: write material = { model = \"FILE.brdf\" }");
    models::MaterialParameters parameters{models::program_parameters(p)};
    parameters.varied = std::move(varied);
    parameters.shininess = p.shininess;
    parameters.bands = p.bands;
    return parameters;
}

} // namespace

ModelMaterialParameters load_material_model(const std::string& file) {
    return {models::defaults_of(models::load_model(file, "material"))};
}

scene::ParameterList declare(ModelMaterialParameters& p, const config::Value* table) {
    scene::ParameterList list;
    if (p.loaded == nullptr) return list;
    const models::Model& model = *p.loaded->model;
    const std::vector<std::size_t> by_image = image_parameters(model);
    for (std::size_t i = 0; i < model.parameters().size(); ++i) {
        if (model.parameters()[i].global || model.parameters()[i].type == models::Type::texture) continue;
        config::Key key = parameter_key(p, i, table);
        const bool image = std::find(by_image.begin(), by_image.end(), i) != by_image.end();
        list.push_back(image ? scene::image_or(std::move(key)) : scene::Parameter(std::move(key)));
    }
    list.push_back(shininess_key(p));
    return list;
}

std::shared_ptr<const models::MaterialProgram> varied_law(const ModelMaterialParameters& p) {
    return std::make_shared<models::MaterialProgram>(p.loaded->model,
                                                     law_parameters(p, image_parameters(*p.loaded->model)));
}

std::shared_ptr<const models::MaterialProgram>
law_emission(const ModelMaterialParameters& p, const std::vector<double>& emission, bool varies) {
    if (p.loaded == nullptr || p.loaded->model->function("emission") == nullptr) return nullptr;
    models::MaterialParameters parameters = law_parameters(p, {});
    parameters.emission = emission;
    parameters.emission_varies = varies;
    return std::make_shared<models::MaterialProgram>(p.loaded->model, parameters,
                                                     models::MaterialFunction::emission);
}

std::vector<double> constant_emission(const models::MaterialProgram& law, std::size_t bands) {
    std::vector<Doubles> out(law.outputs());
    std::vector<double*> to_out;
    for (Doubles& row : out)
        to_out.push_back(row.v);
    const std::vector<const double*> rows(law.rows(), nullptr);
    law.evaluate(nullptr, nullptr, nullptr, rows.data(), to_out.data(), packet_size);
    std::vector<double> radiances;
    for (std::size_t c = 0; c < bands; ++c)
        radiances.push_back(out[std::min(c, out.size() - 1)][0]);
    return radiances;
}

ModelMaterial::ModelMaterial(const ModelMaterialParameters& p)
    : same_(p.loaded != nullptr ? p.loaded->model : nullptr, law_parameters(p, {})),
      varied_(varied_law(p)),
      bands_(p.bands) {
    for (const double value : constant_rows(same_, p)) {
        Doubles& row = constants_.emplace_back();
        std::fill_n(row.v, packet_size, value);
    }
}

void ModelMaterial::reflectance(const ScatterPacket& s, Doubles& r) const {
    Channels all;
    reflectances(s, all);
    r = all.v[0];
}

void ModelMaterial::reflectances(const ScatterPacket& s, Channels& r) const {
    Doubles cos_out;
    for (int i = 0; i < packet_size; ++i)
        cos_out[i] = s.cos_out[i] > 1e-9 ? s.cos_out[i] : 1e-9;
    std::array<const double*, max_rows> rows{};
    const models::MaterialProgram& law = s.varied != nullptr ? *varied_ : same_;
    for (std::size_t k = 0; k < law.rows(); ++k)
        rows[k] = s.varied != nullptr ? s.varied->value[k].v : constants_[k].v;
    std::array<double*, max_channels> out{};
    for (std::size_t c = 0; c < law.outputs(); ++c)
        out[c] = r.v[c].v;
    law.evaluate(s.cos_in.v, cos_out.v, s.cos_phase.v, rows.data(), out.data(), packet_size);
    for (std::size_t c = 0; c < law.outputs(); ++c)
        for (int i = 0; i < packet_size; ++i)
            r.v[c][i] = s.cos_in[i] > 0 && r.v[c][i] > 0 && r.v[c][i] < 1e6 ? r.v[c][i] : 0.0;
    if (spectral())
        for (std::size_t c = law.outputs(); c < bands_; ++c)
            r.v[c] = r.v[0];
}

std::vector<std::string> model_material_warnings(const scene::Scene& scene) {
    std::vector<std::string> lines;
    for (const scene::Body& body : scene.bodies) {
        const auto* const given = body.material.get_if<ModelMaterialParameters>();
        if (given == nullptr || given->loaded == nullptr) continue;
        ModelMaterialParameters p = *given;
        p.bands = scene.bands.size();
        const models::MaterialProgram law(p.loaded->model, law_parameters(p, {}));
        const models::MaterialReport report = models::report_on(law, constant_rows(law, p));
        for (const std::string& line : models::warnings_by(report, scene.max_bounces > 0))
            lines.push_back(fmt::format("\"{}\": {}: {}", body.name, p.loaded->model->name(), line));
        if (const auto own = law_emission(p, body.emission_w_m2_sr, false)) {
            const std::vector<double> rows(own->rows(), 0.5);
            if (const std::string line = models::warning_by(models::report_on_emission(*own, rows));
                !line.empty())
                lines.push_back(fmt::format("\"{}\": {}: {}", body.name, p.loaded->model->name(), line));
        }
        if (const std::string& text = p.loaded->model->warnings(); !text.empty()) lines.push_back(text);
    }
    return lines;
}

void check_model_material(const scene::Scene& scene, const scene::Body& body, const scene::Material& material,
                          const std::string& place) {
    const auto* const p = material.get_if<ModelMaterialParameters>();
    if (p == nullptr) return;
    if (p->loaded != nullptr)
        if (const std::string why = models::explain_channels(*p, p->bands); !why.empty())
            throw ConfigError(fmt::format("{}: {}: {}", place, p->loaded->model->name(), why));
    const models::MaterialProgram law(p->loaded != nullptr ? p->loaded->model : nullptr,
                                      law_parameters(*p, {}));
    const auto refuse = [&](std::string_view what) {
        throw ConfigError(fmt::format("{}: {}: {}", place, law.model().name(), what));
    };
    const models::MaterialReport report = models::report_on(law, constant_rows(law, *p));
    const std::string why = models::refusal_by(report, scene.max_bounces > 0);
    if (!why.empty()) refuse(why);
    const bool coloured = !body.colour.empty() && std::any_of(body.colour.begin(), body.colour.end(),
                                                              [](double c) { return c != 1; });
    if ((coloured || body.textures.has_albedo()) && !law.is_proportional_to_diffuse())
        refuse(
            "the body has a colour or an albedo texture, and brdf() is not proportional to `diffuse`, which they "
            "are: multiply the result by diffuse, or leave them out");
}

} // namespace obscura::renderer
