// SPDX-License-Identifier: Apache-2.0
// Response of pixels by a model that a user has written in SuMoL, applied to rows.
#pragma once

#include "models/kinds/sensor_program.hpp"
#include "sensors/description.hpp"
#include "sensors/kernels.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace obscura::sensors {

/// Pixels of one read of a row, for the place and the draws of a model.
struct ModelledRow {
    std::int32_t column = 0, row = 0; ///< first pixel on the array
    std::uint32_t first_pixel = 0;    ///< its number, as random numbers count
    std::uint64_t noise_key = 0;      ///< run_key()
    std::uint64_t frame = 0;
    std::uint32_t read = 0, layer = 0;
};

/// The model of a description that has one. Immutable; thread-safe.
class SensorModel {
public:
    /// Throws ConfigError: the model cannot be used.
    explicit SensorModel(const SensorDescription& description);

    [[nodiscard]] bool has(models::SensorStage stage) const noexcept { return program_.has(stage); }
    /// Puts what the stage's function gives for `n` pixels of `in` into `out`, which may be the same. Charge
    /// that is NaN or negative counts as 0, beyond 2^31 e- as that; of digital numbers NaN counts as 0.
    /// Returns the number of such pixels. Real-time safe.
    std::uint32_t apply(models::SensorStage stage, const ModelledRow& row, const float* in, std::size_t n,
                        float* out) const noexcept;

private:
    void fill_normals(models::SensorStage stage, const ModelledRow& row, std::size_t first, std::size_t n,
                      double* const* out) const noexcept;

    models::SensorProgram program_;
    std::array<bool, models::sensor_stages.size()> uses_x_{}, uses_y_{};
};

/// The program of a description that has a model. Throws ConfigError.
[[nodiscard]] models::SensorProgram sensor_program(const SensorDescription& description);
/// Why the model of a description cannot be used; empty: it can, or there is none. Throws ConfigError for a
/// text that does not become a program.
[[nodiscard]] std::string explain_invalid_model(const SensorDescription& description);
/// What a user should know of the model, a line each, without a full stop.
[[nodiscard]] std::vector<std::string> sensor_model_warnings(const SensorDescription& description);

} // namespace obscura::sensors
