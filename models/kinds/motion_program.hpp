// SPDX-License-Identifier: Apache-2.0
// Small motion of a camera by a model of kind "motion", for one set of parameters.
#pragma once

#include "core/geometry.hpp"
#include "models/kinds/model_parameters.hpp"

#include <memory>

namespace obscura::models {

/// Displacement of a camera from its pose, in the camera's frame.
struct SmallMotion {
    Vec3 offset_m{};
    Vec3 rotation_rad{}; ///< axis times angle
};

/// Immutable; thread-safe.
class MotionProgram {
public:
    /// Throws ConfigError `file:line:column: what`, also for a motion that is not finite somewhere in the
    /// first 1000 s.
    MotionProgram(std::shared_ptr<const Model> model, const ModelParameters& parameters);

    /// At scene time `time_s`; what is not finite counts as 0. Real-time safe.
    [[nodiscard]] SmallMotion at(double time_s) const noexcept;
    /// Sum of the turns between instants from `from_s` to `to_s`, rad: the angle that a distant point runs
    /// through, however often it turns back. Of so many instants that motions up to 16 cycles in between are
    /// followed. Real-time safe.
    [[nodiscard]] double path_rad(double from_s, double to_s) const noexcept;
    /// Largest rotation and offset in the first 1000 s, from 8192 random times.
    [[nodiscard]] double max_rotation_rad() const noexcept { return max_rotation_rad_; }
    [[nodiscard]] double max_offset_m() const noexcept { return max_offset_m_; }

    [[nodiscard]] const std::string& why_interpreted() const noexcept { return bound_.why_interpreted; }
    [[nodiscard]] const Program& program() const noexcept { return *bound_.program; }
    /// Place of rotation() in the text.
    [[nodiscard]] Place place() const noexcept { return model_->function("rotation")->at; }

private:
    void run(const double* times, double* const* outputs, std::size_t lanes) const noexcept;

    std::shared_ptr<const Model> model_;
    BoundProgram bound_;
    double max_rotation_rad_ = 0, max_offset_m_ = 0;
};

} // namespace obscura::models
