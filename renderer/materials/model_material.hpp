// SPDX-License-Identifier: Apache-2.0
// Scattering law that a user has written in SuMoL.
#pragma once

#include "models/kinds/material_program.hpp"
#include "renderer/materials/material.hpp"
#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"

#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::renderer {

/// A model of a scattering law with the names of its parameters as keys.
struct LoadedModel {
    std::shared_ptr<const models::Model> model;
    std::vector<std::string> keys;  ///< of Model::parameters(): name, and the unit "deg" at its end
    std::vector<std::string> helps; ///< of the keys
};
/// Reads a file. Throws ConfigError or InputError.
[[nodiscard]] std::shared_ptr<const LoadedModel> load_material_model(const std::string& file);

/// Parameters of ModelMaterial: those that the model declares.
struct ModelMaterialParameters {
    static constexpr std::string_view kind = "model";
    static constexpr std::string_view help =
        "A law of your own in a SuMoL file, see models.md: material = { model = \"FILE.brdf\", PARAMETER = VALUE }.";
    using Family = scene::MaterialFamily;

    std::shared_ptr<const LoadedModel> loaded; ///< null: none
    /// Four for each of Model::parameters(), angles in radians; textures are 1. Of a vec4, whose channels are
    /// all the same, only the first counts.
    std::vector<std::array<double, 4>> values;
    double shininess = 1;
};
/// With the defaults of `loaded`.
[[nodiscard]] ModelMaterialParameters defaults_of(std::shared_ptr<const LoadedModel> loaded);
/// A parameter that is a texture has a number, which counts where its image has none.
[[nodiscard]] scene::ParameterList declare(ModelMaterialParameters& p);

/// Runs brdf() of a model. What is not positive, or beyond 1e6, counts as 0.
class ModelMaterial final : public Material {
public:
    using Parameters = ModelMaterialParameters;

    /// Throws ConfigError: there is no model, or a renderer cannot use it.
    explicit ModelMaterial(const ModelMaterialParameters& p);
    void reflectance(const ScatterPacket& s, Doubles& r) const override;

private:
    models::MaterialProgram same_; ///< parameters as they are
    /// With the parameters of ScatterPacket::varied lane by lane.
    models::MaterialProgram varied_;
};

/// What users should know of the laws of `scene` that they have written, a line each, without a full stop.
[[nodiscard]] std::vector<std::string> model_material_warnings(const scene::Scene& scene);
/// Throws ConfigError for a law that the scene cannot use, as that of a body called `place`: not finite, more
/// light than comes in with reflections, or colours that it does not take.
void check_model_material(const scene::Scene& scene, const scene::Body& body, const std::string& place);

} // namespace obscura::renderer
