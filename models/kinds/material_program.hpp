// SPDX-License-Identifier: Apache-2.0
// Scattering law of a model of kind "material", for one set of parameters.
#pragma once

#include "models/model/model.hpp"
#include "models/program/program.hpp"

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace obscura::models {

/// Parameters of a material: `values` has four numbers for each of Model::parameters() (the first ones of
/// smaller types), as the text sees them; those listed in `varied` come lane by lane instead. A texture that
/// does not vary has the same value everywhere.
struct MaterialParameters {
    std::vector<std::array<double, 4>> values;
    std::vector<std::size_t> varied; ///< indices in Model::parameters()
    double shininess = 1;
    /// Machine code is made for this, or none: the interpreter. Both give the same bits.
    NativeTarget target = native_target();
};
/// The defaults of `model`, angles in radians; textures are 1.
[[nodiscard]] MaterialParameters default_parameters(const Model& model);

/// Immutable; thread-safe. Directions are those of the local frame of the surface: z along the normal, x
/// towards the camera's projection.
class MaterialProgram {
public:
    /// Throws ConfigError `file:line:column: what` for what a renderer cannot do with this law.
    MaterialProgram(std::shared_ptr<const Model> model, const MaterialParameters& parameters);

    /// BRDF times cos_in, 1/sr, as the text gives it: may be negative, infinite or NaN. cos_out > 0;
    /// varied[k]: lanes of the k-th varied parameter. `lanes` is a multiple of Program::lane_step. Real-time
    /// safe.
    void evaluate(const double* cos_in, const double* cos_out, const double* cos_phase,
                  const double* const* varied, double* r, std::size_t lanes) const noexcept;

    /// Whether the result is proportional to `diffuse`, so that a body's colours are factors on it.
    [[nodiscard]] bool is_proportional_to_diffuse() const noexcept { return proportional_; }
    /// Why the interpreter runs; empty: machine code does.
    [[nodiscard]] const std::string& why_interpreted() const noexcept { return why_interpreted_; }
    [[nodiscard]] const Program& program() const noexcept { return *program_; }
    [[nodiscard]] const Model& model() const noexcept { return *model_; }

    /// Most parameters that may vary.
    static constexpr std::size_t max_varied = 16;

private:
    void compile(const MaterialParameters& parameters);
    /// Refuses a program whose result depends on what a renderer does not give.
    void refuse_inputs(Place at) const;
    [[nodiscard]] std::vector<double> uniforms_of(const MaterialParameters& parameters, double diffuse) const;
    void find_proportion(const MaterialParameters& parameters);

    std::shared_ptr<const Model> model_;
    std::unique_ptr<Program> program_;
    std::string why_interpreted_;
    Uniforms uniforms_;
    std::size_t varied_ = 0;
    bool proportional_ = false;
};

} // namespace obscura::models
