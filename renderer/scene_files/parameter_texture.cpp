// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene_files/parameter_texture.hpp"

#include "renderer/scene_files/model_table.hpp"
#include "renderer/scene_files/section_rules.hpp"

#include <fmt/format.h>

#include <utility>

namespace obscura::scene {

std::vector<ParameterTexture> textures_of(const ParameterList& parameters) {
    std::vector<ParameterTexture> textures;
    for (const Parameter& parameter : parameters) {
        if (!parameter.image) continue;
        ParameterTexture t;
        t.parameter = quantity_of(parameter.key);
        t.constant_key = parameter.key.name;
        t.unit = parameter.key.unit();
        t.file_key = t.parameter + "_texture";
        t.range_key = t.parameter + "_texture_range";
        t.file_help = fmt::format(
            "Image of one plane that gives {} over the surface, instead of a constant; empty: none",
            t.constant_key);
        t.range_help =
            fmt::format("Values of {} for a texel of 0 and a texel of 1 (integers: full scale) of {}",
                        t.constant_key, t.file_key);
        if (const auto* scaled = std::get_if<config::Scaled>(&parameter.key.target)) t.si = scaled->si;
        textures.push_back(std::move(t));
    }
    return textures;
}

config::Keys texture_keys(std::vector<ParameterTexture>& textures) {
    config::Keys keys;
    for (ParameterTexture& t : textures) {
        keys.push_back(
            config::key(t.file_key, config::Path{&t.file, true, true}).or_table().help(t.file_help));
        keys.push_back(config::key(t.range_key, config::Numbers{t.range.data(), t.range.size()})
                           .unit(t.unit)
                           .range(-1e6, 1e6)
                           .help(t.range_help));
    }
    return keys;
}

void add_parameter_textures(const std::vector<ParameterTexture>& textures, Textures& body,
                            const config::ReadTable& table) {
    for (const ParameterTexture& t : textures) {
        exclude(table, t.file_key, t.constant_key);
        if (table.has(t.range_key)) require(table, t.file_key);
        if (!t.file.empty())
            body.parameters.push_back({t.parameter, t.file, t.range[0] * t.si, t.range[1] * t.si});
        else if (auto model = read_texture_model(table, t.file_key))
            body.parameters.push_back(
                {t.parameter, "", t.range[0] * t.si, t.range[1] * t.si, std::move(model)});
    }
}

} // namespace obscura::scene
