// SPDX-License-Identifier: Apache-2.0
// Tables of a point spread function at one field position: grids of the core and profiles of the wings.
#pragma once

#include "models/kinds/psf_program.hpp"
#include "renderer/camera/projection.hpp"
#include "renderer/camera/psf_file.hpp"
#include "renderer/scene/scene.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace obscura::renderer {

/// Entries of a table of the wings, by the logarithm of the squared distance.
constexpr std::size_t psf_wing_entries = 2048;

/// Radii of core and wings, in pitches of the columns, and the grid of the core.
struct PsfExtent {
    double core_px = 0;
    double wings_px = 0;   ///< 0: none, all light is in the core
    double aspect = 1;     ///< see scene::Camera::pixel_aspect()
    std::int32_t half = 0; ///< see PsfCore

    [[nodiscard]] bool has_wings() const { return wings_px > 0; }
};

struct PsfTables {
    std::vector<std::vector<double>> grids; ///< of each band, see PsfCore
    /// Light per px^2 of each band between half the core's radius and that of the wings; none without wings.
    std::vector<std::vector<float>> wings;
};

/// Radius of the disc that a point out of focus becomes, in pitches of the columns.
[[nodiscard]] double defocus_disc_px(const scene::Camera& camera);
/// By the models gaussian and airy.
[[nodiscard]] PsfTables radial_psf_tables(const scene::Camera& camera, const std::vector<SpectralBand>& bands,
                                          const PsfExtent& extent);
/// By images, at one of their field positions. Throws InputError, which names `file`.
[[nodiscard]] PsfTables image_psf_tables(const std::vector<PsfImage>& images, const std::string& file,
                                         ImagePoint field, std::size_t bands, const PsfExtent& extent);

/// By a model, for points at `field` of the sensor, px.
[[nodiscard]] PsfTables model_psf_tables(const models::PsfProgram& psf, const scene::Camera& camera,
                                         ImagePoint field, const std::vector<SpectralBand>& bands,
                                         const PsfExtent& extent);
/// What a model is asked for beside the place, in the middle of the sensor, at 550 nm.
[[nodiscard]] models::PsfConditions psf_conditions(const scene::Camera& camera);

} // namespace obscura::renderer
