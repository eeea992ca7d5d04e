// SPDX-License-Identifier: Apache-2.0
// Response of a sensor's pixels by a model of kind "sensor", for one set of parameters.
#pragma once

#include "models/kinds/model_parameters.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace obscura::models {

/// Place of a function in the signal chain.
enum class SensorStage : std::uint8_t {
    light,   ///< expected charge in e-, before shot noise
    collect, ///< charge in e- after shot noise: in place of full well and non-linearity
    convert, ///< signal in DN, with noise, gain and black level, before the converter
};
inline constexpr std::array sensor_stages{SensorStage::light, SensorStage::collect, SensorStage::convert};

/// Immutable; thread-safe.
class SensorProgram {
public:
    /// Inputs of a stage: the value, column and row of the pixel on the array, and normal draws.
    enum Input : std::int32_t { value, x, y, first_normal };
    /// normal(n) has n from 0 to this, exclusive.
    static constexpr std::int32_t max_normals = 8;
    static constexpr std::size_t max_inputs = first_normal + max_normals;

    /// Throws ConfigError `file:line:column: what`. `full_well_e` is the constant `full_well`.
    SensorProgram(std::shared_ptr<const Model> model, const ModelParameters& parameters, double full_well_e);

    [[nodiscard]] bool has(SensorStage stage) const noexcept { return of(stage).bound.program != nullptr; }
    /// Largest n of normal(n) that the stage reads, plus one.
    [[nodiscard]] std::int32_t normals(SensorStage stage) const noexcept { return of(stage).normals; }
    /// Results of a stage that the model has, of `lanes` pixels, a multiple of Program::lane_step: as the
    /// text gives them, also negative, infinite or NaN. Real-time safe.
    void run(SensorStage stage, const std::array<const double*, max_inputs>& inputs, double* results,
             std::size_t lanes) const noexcept;

    /// Name of the function of a stage in the text.
    [[nodiscard]] static std::string_view name_of(SensorStage stage) noexcept;
    /// Place of it; of the first one that the model has, if not of that.
    [[nodiscard]] Place at(SensorStage stage) const noexcept;
    [[nodiscard]] const Program& program(SensorStage stage) const noexcept {
        return *of(stage).bound.program;
    }
    [[nodiscard]] const std::string& why_interpreted(SensorStage stage) const noexcept {
        return of(stage).bound.why_interpreted;
    }
    [[nodiscard]] const Model& model() const noexcept { return *model_; }

private:
    struct Stage {
        BoundProgram bound; ///< no program: the model does not have the function
        std::int32_t normals = 0;
    };
    [[nodiscard]] const Stage& of(SensorStage stage) const noexcept {
        return stages_[static_cast<std::size_t>(stage)];
    }

    std::shared_ptr<const Model> model_;
    std::array<Stage, sensor_stages.size()> stages_{};
};

} // namespace obscura::models
