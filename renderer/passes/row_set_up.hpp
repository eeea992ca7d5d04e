// SPDX-License-Identifier: Apache-2.0
// Setting up a row: the instants of its exposure, and lens and state of the scene at each.
#pragma once

#include "core/camera/frame_quality.hpp"
#include "core/geometry.hpp"
#include "renderer/passes/built_scene.hpp"
#include "renderer/passes/pass_request.hpp"
#include "renderer/passes/scratch.hpp"
#include "renderer/world/exposure.hpp"

#include <cstddef>
#include <cstdint>
#include <span>

// All functions are reentrant: one Scratch for each thread. They allocate only for more instants than before.
namespace obscura::renderer {

/// Instants at which a row is rendered.
[[nodiscard]] Exposure exposure_of(const BuiltScene& built, const RowTime& row, Scratch& s);
/// Instants at which the pixels of a row are sampled at a level.
[[nodiscard]] Exposure exposure_at(const BuiltScene& built, QualityLevel level, const RowTime& row,
                                   Scratch& s);
/// Least number of samples of a pixel, see begin_row().
[[nodiscard]] std::uint32_t min_samples_of(const BuiltScene& built, const Exposure& when);

/// Sets Scratch::lens for a row, by the aberration of the camera's velocity over that of light.
void set_lens(const BuiltScene& built, Vec3 beta, Scratch& s);
/// Sets the lens and state `i` of a set-up, of Scratch::whole if none is given.
RowState& begin_row(const BuiltScene& built, double time_s, Scratch& s, std::size_t i = 0,
                    std::uint32_t min_samples = 1);
RowState& begin_row(const BuiltScene& built, double time_s, Scratch& s, RowSetUp& states, std::size_t i,
                    std::uint32_t min_samples);
/// Sets up `states` at the instants of a row, unless they are those of the row of the same request before:
/// the rows of a global shutter are exposed together.
void begin_rows(const BuiltScene& built, std::uint64_t request, const Exposure& when, Scratch& s,
                RowSetUp& states);
/// Makes room in the memory of a thread for rows `width` pixels wide at any number of instants.
void reserve(const BuiltScene& built, Scratch& s, std::int32_t width);

/// Whether any body is small enough to be lost between the points of a grid, but larger than pixels.
[[nodiscard]] bool has_small(std::span<const RowState> rows);
/// Whether any body in the field, all of which is within `field_rad` of the boresight, is larger than pixels.
[[nodiscard]] bool resolves_any(const RowState& row, double field_rad);

} // namespace obscura::renderer
