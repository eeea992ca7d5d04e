// SPDX-License-Identifier: Apache-2.0
// Scattering law and emission of a model of kind "material", for one set of parameters.
#pragma once

#include "models/kinds/look_ups.hpp"
#include "models/kinds/model_parameters.hpp"

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace obscura::models {

/// Parameters of a law, and the arguments of its functions that are the same for all samples.
struct MaterialParameters : ModelParameters {
    double shininess = 1;
    /// Spectral bands: each is a channel, in fours; a function runs once for each four of them.
    std::size_t bands = 1;
    /// Argument `emission` in each band; empty: 0. With `emission_varies` it comes lane by lane instead.
    std::vector<double> emission{};
    bool emission_varies = false;
};

enum class MaterialFunction : std::uint8_t { brdf, emission };

/// What a law may know of the point that is hit: its rows follow those of the varied parameters.
enum class SurfaceRow : std::uint8_t { t, duration, u, v, lod_bias };
constexpr std::size_t surface_rows = 5;

/// Immutable; thread-safe. Directions are those of the local frame of the surface: z along the normal, x
/// towards the camera's projection.
///
/// Besides the angles its inputs are rows, lane by lane: the varied parameters, those of SurfaceRow, of
/// emission() with `emission_varies` one for each band, and four for each read of a texture.
class MaterialProgram {
public:
    /// Throws ConfigError `file:line:column: what` for what a renderer cannot do with this law.
    MaterialProgram(std::shared_ptr<const Model> model, const MaterialParameters& parameters,
                    MaterialFunction function = MaterialFunction::brdf);

    /// BRDF times cos_in, 1/sr, or the radiance that is emitted, W m-2 sr-1, as the text gives it: may be
    /// negative, infinite or NaN; r: rows of outputs(). cos_out > 0; rows that uses_row() denies may be null.
    /// `lanes` is a multiple of Program::lane_step. Real-time safe.
    void evaluate(const double* cos_in, const double* cos_out, const double* cos_phase,
                  const double* const* rows, double* const* r, std::size_t lanes) const noexcept;
    /// One for each band, or one that is the same in all.
    [[nodiscard]] std::size_t outputs() const noexcept { return outputs_; }

    [[nodiscard]] std::size_t rows() const noexcept { return first_read_ + 4 * places_.list().size(); }
    [[nodiscard]] std::size_t row(SurfaceRow which) const noexcept {
        return varied_ + static_cast<std::size_t>(which);
    }
    [[nodiscard]] std::size_t first_emission_row() const noexcept { return varied_ + surface_rows; }
    [[nodiscard]] std::size_t first_read_row() const noexcept { return first_read_; }
    /// Whether the result or the place of a read depends on a row.
    [[nodiscard]] bool uses_row(std::size_t row) const noexcept;
    /// Whether the result differs from point to point other than by the varied parameters.
    [[nodiscard]] bool differs_by_point() const noexcept;
    /// Whether the result depends on any input.
    [[nodiscard]] bool is_constant() const noexcept;

    [[nodiscard]] const std::vector<LookUp>& reads() const noexcept { return places_.list(); }
    /// Place of a read that is not own_place. Real-time safe.
    void read_at(std::size_t read, const double* const* rows, double* const* at,
                 std::size_t lanes) const noexcept;

    /// Whether the result is proportional to `diffuse`, so that a body's colours are factors on it.
    [[nodiscard]] bool is_proportional_to_diffuse() const noexcept { return proportional_; }
    /// Why the interpreter runs; empty: machine code does.
    [[nodiscard]] const std::string& why_interpreted() const noexcept { return bound_.why_interpreted; }
    [[nodiscard]] const Program& program() const noexcept { return *bound_.program; }
    [[nodiscard]] const Model& model() const noexcept { return *model_; }
    [[nodiscard]] Place place() const noexcept { return at_; }

    /// Most parameters that may vary.
    static constexpr std::size_t max_varied = 16;
    static constexpr std::size_t max_rows = 48;
    static constexpr std::size_t max_bands = 16;

private:
    void compile(const MaterialParameters& parameters, const Function& function, bool emits);
    void find_proportion(const MaterialParameters& parameters);

    std::shared_ptr<const Model> model_;
    Place at_;
    BoundProgram bound_;
    LookUpPlaces places_;
    std::size_t varied_ = 0, first_read_ = 0, outputs_ = 1;
    bool proportional_ = false;
};

} // namespace obscura::models
