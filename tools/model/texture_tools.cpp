// SPDX-License-Identifier: Apache-2.0
#include "tools/model/texture_tools.hpp"

#include "renderer/textures/procedural_texture.hpp"
#include "tools/pictures/figure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace obscura::tools {
namespace {

constexpr std::string_view new_texture = R"(// {0}: a texture in SuMoL.
//
//   obscura model check {0}.txr            is it sound?
//   obscura model plot {0}.txr -o {0}.png  what does it look like?
//
// In a scene file, beside it:
//   [[body]]
//   albedo_texture = {{ model = "{0}.txr", squares = 12 }}

// A parameter is a key of the scene. Its comment gives unit, range and meaning.
parameter squares 8;   //! , 1..1000, Squares across and down
parameter dark 0.2;    //! , 0..1, Value of the dark squares
parameter light 0.8;   //! , 0..1, Value of the light squares

// Functions stand before their use. All numbers are real: 1 / 2 is 0.5.
scalar odd(scalar x)
{{
    return fmod(floor(x), 2);
}}

// Value of the texture in each channel, which is a band of the scene; vec4(M_NAN) is no data.
//   tex  an image, if the scene gives one: tex = "FILE"; lookupLOD(tex, uv, lod) reads it, size(tex) are its texels
//   uv   place, 0 to 1 to the right and down
//   lod  log2 of the width of the sample in texels of the image
// A texture that has vec4 lookup3D(texture tex, vec3 los, scalar lod) instead gets the direction from the body's centre.
vec4 lookup2D(texture tex, vec2 uv, scalar lod)
{{
    return vec4(odd(uv.x * squares) == odd(uv.y * squares) ? light : dark);
}}
)";

/// Images are grey, of 1024 x 512 texels.
renderer::ProceduralTexture texture_of(const models::ModelValues& p) {
    models::TextureParameters parameters{models::program_parameters(p)};
    const std::size_t images = p.loaded->model->parameters().size() + 1;
    parameters.bands = 4;
    parameters.images.assign(images, {1024, 512, true});
    const auto grey = std::make_shared<const renderer::Texture>(
        2, 1, std::vector<std::vector<float>>{{0.5F, 0.5F}}, renderer::Texture::Edge::repeat);
    return {std::make_shared<models::TextureProgram>(p.loaded->model, parameters),
            std::vector<renderer::ProceduralTexture::Image>(images, {grey, {}})};
}

ModelCost texture_cost(const models::ModelValues& p) {
    const renderer::ProceduralTexture texture = texture_of(p);
    ModelCost cost = cost_of(texture.program().program(), texture.program().why_interpreted());
    cost.facts.push_back({"read by", texture.program().by_position() ? "direction" : "coordinates",
                          "by_direction", texture.program().by_position()});
    cost.facts.push_back({"reads of images", fmt::format("{}", texture.program().reads().size()), "reads",
                          texture.program().reads().size()});
    return cost;
}

ModelVerdict texture_check(const models::ModelValues& p) {
    const renderer::ProceduralTexture texture = texture_of(p);
    const renderer::ProceduralTexture::Range range = texture.range(1);
    ModelVerdict verdict;
    verdict.at = texture.program().place();
    if (range.infinite_share > 0)
        verdict.refusal = fmt::format("is not finite for {:.1f} % of the texture, {}",
                                      std::max(0.1, 100 * range.infinite_share), range.infinite_at);
    if (range.no_data_share > 0)
        verdict.warnings.push_back(
            fmt::format("no data for {:.1f} % of the texture", std::max(0.1, 100 * range.no_data_share)));
    if (range.negative_share > 0)
        verdict.warnings.push_back(fmt::format("negative for {:.1f} % of the texture, most {}",
                                               std::max(0.1, 100 * range.negative_share), range.negative_at));
    verdict.summary = fmt::format("{} operations a sample, values from {:.4g} to {:.4g} with images of 0.5",
                                  texture.program().program().cost(), range.least, range.largest);
    return verdict;
}

/// Values of channel 0 at the given places: coordinates, and directions by longitude and latitude.
std::vector<double> texture_values(const renderer::ProceduralTexture& texture,
                                   const std::vector<std::pair<double, double>>& uv, std::size_t channel) {
    std::vector<double> values;
    for (std::size_t first = 0; first < uv.size(); first += renderer::packet_size) {
        renderer::TexturePoints points{};
        for (int i = 0; i < renderer::packet_size; ++i) {
            const auto [u, v] = uv[std::min(first + static_cast<std::size_t>(i), uv.size() - 1)];
            points.here.on[i] = -1;
            points.u[i] = u;
            points.v[i] = v;
            const double longitude = 2 * std::numbers::pi * (u - 0.5),
                         latitude = std::numbers::pi * (0.5 - v);
            points.position.set(i, {std::cos(latitude) * std::cos(longitude),
                                    std::cos(latitude) * std::sin(longitude), std::sin(latitude)});
        }
        renderer::Channels out;
        texture.sample(points, 4, out);
        for (int i = 0; i < renderer::packet_size && values.size() < uv.size(); ++i)
            values.push_back(out.v[channel][i]);
    }
    return values;
}

ModelFacts texture_eval(const models::ModelValues& p, const ModelPoint& at) {
    const renderer::ProceduralTexture texture = texture_of(p);
    std::vector<double> channels;
    for (std::size_t c = 0; c < 4; ++c)
        channels.push_back(texture_values(texture, {{at.at("u"), at.at("v")}}, c)[0]);
    return {{"channels", fmt::format("{:.12g}", fmt::join(channels, ", ")), "channels", channels}};
}

void texture_plot(const models::ModelValues& p, std::string_view title, const std::filesystem::path& file) {
    const renderer::ProceduralTexture texture = texture_of(p);
    const renderer::ProceduralTexture::Range range = texture.range(1);
    constexpr int width = 384, height = 192;
    ColourScale scale;
    scale.map = ColourMap::viridis;
    scale.low = range.least;
    scale.high = range.largest > range.least ? range.largest : range.least + 1;
    scale.label = "value";
    Panel panel;
    panel.title = std::string(title);
    panel.width = width;
    panel.height = height;
    std::vector<std::pair<double, double>> uv;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            uv.emplace_back((x + 0.5) / width, (y + 0.5) / height);
    for (const double value : texture_values(texture, uv, 0))
        panel.pixels.push_back(scale.colour_of(std::isnan(value) ? scale.low : value));
    panel.scale = scale;
    draw_panels({panel}).write(file);
}

} // namespace

const KindTools& texture_tools() {
    static const KindTools tools{
        "texture",
        new_texture,
        texture_cost,
        texture_check,
        {{"u", "", "Place to the right; of a texture by direction: longitude from -180 to 180 degrees", 0.5,
          0, 1},
         {"v", "", "Place downwards; of a texture by direction: latitude from 90 to -90 degrees", 0.5, 0, 1}},
        texture_eval,
        {{".png", "the texture's first channel, with images of 0.5"}},
        texture_plot,
        nullptr};
    return tools;
}

} // namespace obscura::tools
