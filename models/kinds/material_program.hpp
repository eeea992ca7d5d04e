// SPDX-License-Identifier: Apache-2.0
// Scattering law of a model of kind "material", for one set of parameters.
#pragma once

#include "models/kinds/model_parameters.hpp"

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace obscura::models {

struct MaterialParameters : ModelParameters {
    double shininess = 1;
};

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
    [[nodiscard]] const std::string& why_interpreted() const noexcept { return bound_.why_interpreted; }
    [[nodiscard]] const Program& program() const noexcept { return *bound_.program; }
    [[nodiscard]] const Model& model() const noexcept { return *model_; }

    /// Most parameters that may vary.
    static constexpr std::size_t max_varied = 16;

private:
    void compile(const MaterialParameters& parameters);
    /// Refuses a program whose result depends on what a renderer does not give.
    void refuse_inputs(Place at) const;
    [[nodiscard]] static std::vector<double> uniforms_of(const MaterialParameters& parameters,
                                                         double diffuse);
    void find_proportion(const MaterialParameters& parameters);

    std::shared_ptr<const Model> model_;
    BoundProgram bound_;
    std::size_t varied_ = 0;
    bool proportional_ = false;
};

} // namespace obscura::models
