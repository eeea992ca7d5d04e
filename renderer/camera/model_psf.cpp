// SPDX-License-Identifier: Apache-2.0
#include "renderer/camera/model_psf.hpp"

#include "core/error.hpp"
#include "renderer/camera/psf_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <string_view>

namespace obscura::renderer {
namespace {

/// Tells `hear` what the function does in the middle and, if it depends on the place, in the corners.
void look_at_places(const models::PsfProgram& psf, const scene::Camera& camera,
                    const std::function<void(const models::PsfReport&, const std::string& place)>& hear) {
    models::PsfConditions conditions = psf_conditions(camera);
    const auto report = [&](const std::string& place) {
        hear(models::report_on(psf, conditions, camera.psf.core_px, camera.psf.wings_px), place);
    };
    report("");
    if (!psf.depends_on_field()) return;
    for (const int y : {0, camera.height - 1})
        for (const int x : {0, camera.width - 1}) {
            conditions.field_x_px = x - (camera.width - 1) / 2.0;
            conditions.field_y_px = y - (camera.height - 1) / 2.0;
            report(fmt::format(" for points at ({}, {}) px", x, y));
        }
}

} // namespace

models::PsfProgram psf_program(const scene::Camera& camera) {
    const models::ModelValues& own = camera.psf.own;
    if (own.loaded == nullptr)
        throw ConfigError("camera: psf: the model's file is missing: write psf = { model = \"FILE.psf\" }");
    models::PsfProgram psf(own.loaded->model, models::program_parameters(own));
    look_at_places(psf, camera, [&](const models::PsfReport& report, const std::string& place) {
        const std::string why = models::refusal_by(report, camera.psf.core_px);
        if (!why.empty())
            throw ConfigError(fmt::format("camera: psf: {}: {}{}", psf.model().name(), why, place));
    });
    return psf;
}

std::vector<std::string> psf_warnings(const scene::Camera& camera) {
    std::vector<std::string> lines;
    if (camera.psf.model != scene::PointSpread::Model::model) return lines;
    const models::PsfProgram psf = psf_program(camera);
    look_at_places(psf, camera, [&](const models::PsfReport& report, const std::string& place) {
        for (const std::string& line : models::warnings_by(report, camera.psf.core_px, camera.psf.wings_px))
            lines.push_back(fmt::format("camera: psf: {}: {}{}", psf.model().name(), line, place));
    });
    if (const std::string& text = psf.model().warnings(); !text.empty()) lines.push_back(text);
    return lines;
}

} // namespace obscura::renderer
