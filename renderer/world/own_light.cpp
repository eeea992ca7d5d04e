// SPDX-License-Identifier: Apache-2.0
#include "renderer/world/own_light.hpp"

#include "core/error.hpp"
#include "models/kinds/material_checks.hpp"
#include "renderer/materials/model_material.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace obscura::renderer {

OwnLight own_light(const scene::Body& body, const scene::Material& material, std::size_t bands) {
    const std::string place = fmt::format("body '{}'", body.name);
    const bool mapped = body.textures.has_emission();
    OwnLight light{body.emission_w_m2_sr, nullptr, !mapped};
    const auto* const model = material.get_if<ModelMaterialParameters>();
    if (model == nullptr) return light;
    light.law = law_emission(*model, body.emission_w_m2_sr, mapped && !body.emission_w_m2_sr.empty());
    if (light.law == nullptr) return light;
    const models::EmissionReport report =
        models::report_on_emission(*light.law, std::vector<double>(light.law->rows(), 0.5));
    if (const std::string why = models::refusal_by(report); !why.empty())
        throw ConfigError(fmt::format("{}: {}: {}", place, light.law->model().name(), why));
    if (!light.law->is_constant()) {
        light.uniform = false;
        light.radiance_w_m2_sr.assign(bands, 1);
        return light;
    }
    light.radiance_w_m2_sr = constant_emission(*light.law, bands);
    for (const double value : light.radiance_w_m2_sr)
        if (!(value >= 0 && value <= 1e15))
            throw ConfigError(fmt::format("{}: {}: emission() is {}: allowed is 0 to 1e15 W m-2 sr-1", place,
                                          light.law->model().name(), value));
    if (std::all_of(light.radiance_w_m2_sr.begin(), light.radiance_w_m2_sr.end(),
                    [](double value) { return value == 0; }))
        light.radiance_w_m2_sr.clear();
    light.uniform = true;
    light.law = nullptr;
    return light;
}

} // namespace obscura::renderer
