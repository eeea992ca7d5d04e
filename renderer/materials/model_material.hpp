// SPDX-License-Identifier: Apache-2.0
// Scattering law that a user has written in SuMoL.
#pragma once

#include "models/kinds/material_program.hpp"
#include "renderer/materials/material.hpp"
#include "renderer/scene/kind.hpp"
#include "renderer/scene/model_values.hpp"
#include "renderer/scene/scene.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace obscura::renderer {

/// Parameters of ModelMaterial: those that the model declares. Of a vec4, whose channels are all the same,
/// only the first counts.
struct ModelMaterialParameters : scene::ModelValues {
    static constexpr std::string_view kind = "model";
    static constexpr std::string_view help =
        "A law of your own in a SuMoL file, see models.md: material = { model = \"FILE.brdf\", PARAMETER = VALUE }.";
    using Family = scene::MaterialFamily;
};
/// The law of a file with its defaults. Throws ConfigError or InputError.
[[nodiscard]] ModelMaterialParameters load_material_model(const std::string& file);
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
