// SPDX-License-Identifier: Apache-2.0
#include "renderer/camera/lens_cards.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <numbers>
#include <string>

namespace obscura::renderer {
namespace {

/// A keyword has room for three digits.
constexpr std::size_t max_table_rows = 1000;

} // namespace

images::Cards lens_cards(const scene::Camera& camera) {
    const scene::Distortion& d = camera.distortion;
    const bool table = d.model == scene::Distortion::Model::table;
    const std::size_t count =
        table ? std::min({d.ideal_mm.size(), d.real_mm.size(), max_table_rows}) : d.coefficients.size();
    images::Cards cards{
        {"PROJ", std::string(name_of(camera.projection)), "projection of the lens"},
        {"SENSROT", camera.sensor_rotation_rad * 180 / std::numbers::pi,
         "[deg] sensor about the axis, right to down"},
        {"DISTMODL", std::string(name_of(d.model)), "model of the lens distortion"},
        {"DISTN", static_cast<std::int64_t>(count), "coefficients of it, or rows of its table"},
    };
    if (camera.projection == scene::Projection::model && camera.own_projection.loaded != nullptr)
        cards.push_back(
            {"PRJMODEL",
             std::filesystem::path(camera.own_projection.loaded->model->name()).filename().string(),
             "file of the projection's model"});
    for (std::size_t i = 0; i < count; ++i) {
        if (table) {
            cards.push_back(
                {fmt::format("DISTI{:03}", i), d.ideal_mm[i], "[mm] ideal distance from the axis"});
            cards.push_back({fmt::format("DISTR{:03}", i), d.real_mm[i], "[mm] real distance from the axis"});
        } else {
            cards.push_back(
                {fmt::format("DIST{:02}", i), d.coefficients[i], "coefficient of the distortion"});
        }
    }
    return cards;
}

} // namespace obscura::renderer
