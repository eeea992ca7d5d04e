// SPDX-License-Identifier: Apache-2.0
// Scattering law that a user has written in SuMoL.
#pragma once

#include "models/kinds/material_program.hpp"
#include "models/values/model_values.hpp"
#include "renderer/materials/material.hpp"
#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::renderer {

/// Parameters of ModelMaterial: those that the model declares.
struct ModelMaterialParameters : models::ModelValues {
    static constexpr std::string_view kind = "model";
    static constexpr std::string_view help =
        "A law of your own in a SuMoL file, see models.md: material = { model = \"FILE.brdf\", PARAMETER = VALUE }.";
    using Family = scene::MaterialFamily;

    std::size_t bands = 1; ///< of the scene
};
/// The law of a file with its defaults. Throws ConfigError or InputError.
[[nodiscard]] ModelMaterialParameters load_material_model(const std::string& file);
/// `table`: see parameter_key().
[[nodiscard]] scene::ParameterList declare(ModelMaterialParameters& p, const config::Value* table = nullptr);

/// brdf() of the law with the parameters that an image may give as rows, for what it reads at the points that
/// are hit. Throws ConfigError.
[[nodiscard]] std::shared_ptr<const models::MaterialProgram> varied_law(const ModelMaterialParameters& p);
/// emission() of the law for a body that emits `emission` in each band (empty: nothing), lane by lane with
/// `varies`; null: the law has none. Throws ConfigError.
[[nodiscard]] std::shared_ptr<const models::MaterialProgram>
law_emission(const ModelMaterialParameters& p, const std::vector<double>& emission, bool varies);
/// Radiances of emission() that is the same everywhere and towards all directions.
[[nodiscard]] std::vector<double> constant_emission(const models::MaterialProgram& law, std::size_t bands);

/// Runs brdf() of a model. What is not positive, or beyond 1e6, counts as 0.
class ModelMaterial final : public Material {
public:
    using Parameters = ModelMaterialParameters;

    /// Throws ConfigError: there is no model, or a renderer cannot use it.
    explicit ModelMaterial(const ModelMaterialParameters& p);
    void reflectance(const ScatterPacket& s, Doubles& r) const override;
    [[nodiscard]] bool spectral() const override { return same_.outputs() > 1 || varied_->outputs() > 1; }
    void reflectances(const ScatterPacket& s, Channels& r) const override;

private:
    models::MaterialProgram same_; ///< parameters as they are, textures at `constants_`
    /// With the rows of ScatterPacket::varied.
    std::shared_ptr<const models::MaterialProgram> varied_;
    std::size_t bands_;
    std::vector<Doubles> constants_; ///< rows of same_
};

/// What users should know of the laws of `scene` that they have written, a line each, without a full stop.
[[nodiscard]] std::vector<std::string> model_material_warnings(const scene::Scene& scene);
/// Throws ConfigError for a law that the scene cannot use, as `material` of a body called `place`: not
/// finite, more light than comes in with reflections, or colours that it does not take.
void check_model_material(const scene::Scene& scene, const scene::Body& body, const scene::Material& material,
                          const std::string& place);

} // namespace obscura::renderer
