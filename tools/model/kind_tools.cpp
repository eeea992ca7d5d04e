// SPDX-License-Identifier: Apache-2.0
#include "tools/model/kind_tools.hpp"

#include "config/document.hpp"
#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "core/text/printable.hpp"
#include "core/text/suggestion.hpp"
#include "host/command_line.hpp"
#include "models/kinds/model_parameters.hpp"
#include "models/model/entry_points.hpp"
#include "tools/model/material_tools.hpp"
#include "tools/model/motion_tools.hpp"
#include "tools/model/projection_tools.hpp"
#include "tools/model/psf_tools.hpp"
#include "tools/model/sensor_tools.hpp"
#include "tools/model/shape_tools.hpp"
#include "tools/model/texture_tools.hpp"
#include "tools/model/timing_tools.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace obscura::tools {

double property_of(const models::Model& model, std::string_view name, double otherwise, double min,
                   double max) {
    for (const models::Property& p : model.properties()) {
        if (p.name != name) continue;
        if (!(p.value >= min && p.value <= max))
            models::refuse(
                model, p.at,
                fmt::format("the property '{}' is {}: allowed is {}..{}", name, p.value, min, max));
        return p.value;
    }
    return otherwise;
}

ModelCost cost_of(const models::Program& program, std::string why_interpreted) {
    return {program.cost(),       program.slots(), std::move(why_interpreted), program.instructions(), {},
            program.measured_ns()};
}

const std::vector<const KindTools*>& kind_tools() {
    static const std::vector<const KindTools*> tools{&material_tools(), &motion_tools(),     &texture_tools(),
                                                     &psf_tools(),      &projection_tools(), &sensor_tools(),
                                                     &shape_tools(),    &timing_tools()};
    return tools;
}

const KindTools& tools_of(const models::Model& model) {
    const std::string_view kind = models::kind_of(model)->name;
    return **std::find_if(kind_tools().begin(), kind_tools().end(),
                          [&](const KindTools* tools) { return tools->kind == kind; });
}

std::vector<std::filesystem::path> shipped_model_files() {
    std::vector<std::filesystem::path> files;
    for (const KindTools* tools : kind_tools())
        for (const std::filesystem::path& file : config::shipped_files(models::shipped_models(tools->kind)))
            files.push_back(file);
    return files;
}

std::filesystem::path model_path(const std::string& name) {
    if (is_file_at(name)) return name;
    for (const KindTools* tools : kind_tools())
        if (const auto file = config::find_shipped(models::shipped_models(tools->kind), name)) return *file;
    if (name.find('/') != std::string::npos || models::unknown_ending(name).empty()) return name;
    std::vector<std::string> names;
    for (const std::filesystem::path& file : shipped_model_files())
        names.push_back(file.stem().string());
    throw InputError(fmt::format("{}: no such file, and no shipped model: {}", printable(name),
                                 allowed_words(name, {names.begin(), names.end()})));
}

models::ModelValues chosen_model(const std::string& file, const std::vector<std::string>& settings) {
    models::ModelValues p = models::defaults_of(models::load_model(model_path(file).string()));
    std::string text;
    for (const std::string& setting : settings) {
        if (setting.find('=') == std::string::npos)
            throw host::UsageError(fmt::format("--set {}: allowed is NAME=VALUE", printable(setting)));
        text += setting + '\n';
    }
    const config::Value table = config::parse_text(text, "--set");
    config::Keys keys = parameter_keys(p, &table);
    if (models::kind_of(*p.loaded->model)->name == material_tools().kind) keys.push_back(shininess_key(p));
    (void)config::read_keys(table, {"--set", ""}, keys);
    return p;
}

} // namespace obscura::tools
