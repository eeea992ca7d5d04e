// SPDX-License-Identifier: Apache-2.0
// Table of a scene file that names a model written in SuMoL and gives its parameters.
#pragma once

#include "config/section.hpp"
#include "renderer/scene/scene.hpp"

#include <array>
#include <memory>
#include <string_view>

namespace obscura::scene {

/// The tables, by dotted path. All their strings name files.
inline constexpr std::array<std::string_view, 6> model_table_paths{
    "body.material", "body.shape", "camera.psf", "camera.vibration", "camera.projection", "camera.shutter"};

/// Reads `shape = { model = "FILE.shp", PARAMETER = VALUE }` of the table of a body into its shape.
void read_shape_model(const config::ReadTable& table, Body& body);

/// Reads `key = { model = "FILE.txr", tex = "IMAGE", PARAMETER = VALUE }` within `table`: textures are given
/// by the names of images. Null: it is no table, or after mistakes.
[[nodiscard]] std::shared_ptr<const ModelTexture> read_texture_model(const config::ReadTable& table,
                                                                     std::string_view key);

/// Reads `material = { model = "FILE.brdf", PARAMETER = VALUE, PARAMETER_texture = "IMAGE" }` of the table of
/// a body into its material and textures. A parameter that is a texture is given by the image's name.
void read_material_model(const config::ReadTable& table, Body& body);

} // namespace obscura::scene
