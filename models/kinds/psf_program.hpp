// SPDX-License-Identifier: Apache-2.0
// Point spread function of a model of kind "psf", for one set of parameters.
#pragma once

#include "models/kinds/model_parameters.hpp"

#include <memory>
#include <span>
#include <string>
#include <vector>

namespace obscura::models {

/// What a point spread function is asked for beside the place: light of one wavelength through one optics.
struct PsfConditions {
    double wavelength_m = 550e-9;
    double field_x_px = 0, field_y_px = 0; ///< the point, from the centre of the sensor
    double pitch_m = 10e-6;                ///< of the columns
    double f_number = 4;
};

/// Immutable; thread-safe.
class PsfProgram {
public:
    /// Throws ConfigError `file:line:column: what`.
    PsfProgram(std::shared_ptr<const Model> model, const ModelParameters& parameters);

    /// Light per square of the pitch at (x[i], y[i]), which are in pitches of the columns from the point, x
    /// to the right and y down: as the text gives it, also negative, infinite or NaN.
    void density(const PsfConditions& conditions, std::span<const double> x, std::span<const double> y,
                 std::span<double> values) const;

    [[nodiscard]] bool depends_on_wavelength() const noexcept { return depends_on_wavelength_; }
    [[nodiscard]] bool depends_on_field() const noexcept { return depends_on_field_; }
    [[nodiscard]] const std::string& why_interpreted() const noexcept { return bound_.why_interpreted; }
    [[nodiscard]] const Program& program() const noexcept { return *bound_.program; }
    [[nodiscard]] const Model& model() const noexcept { return *model_; }
    /// Place of density() in the text.
    [[nodiscard]] Place at() const noexcept;

private:
    [[nodiscard]] std::vector<double> uniforms_of(const PsfConditions& conditions) const;

    std::shared_ptr<const Model> model_;
    ModelParameters parameters_;
    BoundProgram bound_;
    bool depends_on_wavelength_ = false, depends_on_field_ = false;
};

/// What a point spread function does within a core and wings.
struct PsfReport {
    double core_light = 0;                       ///< integral within the core
    double light = 0;                            ///< within core and wings
    double centroid_x_px = 0, centroid_y_px = 0; ///< of the light within
    bool finite = true;                          ///< everywhere that was looked at
    double least = 0;                            ///< smallest value; below 0: no light
    double bad_x_px = 0, bad_y_px = 0; ///< the first place that is not finite, or that of the smallest value
};
/// On 2048 rings of 64 points, closer together towards the middle. `wings_px` 0: none.
[[nodiscard]] PsfReport report_on(const PsfProgram& psf, const PsfConditions& conditions, double core_px,
                                  double wings_px);
/// Why it cannot be used; empty: it can.
[[nodiscard]] std::string refusal_by(const PsfReport& report, double core_px);
/// What a user should know, a line each, without a full stop.
[[nodiscard]] std::vector<std::string> warnings_by(const PsfReport& report, double core_px, double wings_px);

} // namespace obscura::models
