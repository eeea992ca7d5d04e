// SPDX-License-Identifier: Apache-2.0
#include "models/kinds/texture_program.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace obscura::models {
namespace {

constexpr std::size_t max_texture_bands = 16;

const Function& texture_function(const Model& model) {
    const Function* const by_position = model.function("lookup3D");
    return by_position != nullptr ? *by_position : *model.function("lookup2D");
}

NodeId texture_row(Graph& graph, std::size_t row) {
    return graph.input(static_cast<std::int32_t>(row));
}

/// Uniforms behind those of the parameters: sizes of images, then the channels of vec4 parameters.
std::int32_t size_uniform(const Model& model, std::size_t image, std::size_t side) {
    return first_own_uniform(model) + static_cast<std::int32_t>(2 * image + side);
}

std::int32_t texture_channel_uniform(const Model& model, std::size_t parameter, std::size_t band) {
    return size_uniform(model, model.parameters().size() + 1, 0) +
           static_cast<std::int32_t>(max_texture_bands * parameter + band);
}

std::vector<double> texture_uniforms(const Model& model, const TextureParameters& parameters) {
    std::vector<double> uniforms = uniform_values(parameters);
    for (std::size_t i = 0; i <= model.parameters().size(); ++i) {
        const TextureImage image = i < parameters.images.size() ? parameters.images[i] : TextureImage{};
        uniforms.push_back(image.width);
        uniforms.push_back(image.height);
    }
    for (const std::vector<double>& values : parameters.channels)
        for (std::size_t band = 0; band < max_texture_bands; ++band)
            uniforms.push_back(values.empty() ? 0 : values[std::min(band, values.size() - 1)]);
    return uniforms;
}

/// What a function of a texture may ask of its images.
class TextureSurroundings {
public:
    TextureSurroundings(const Model& model, const TextureParameters& parameters, Graph& graph)
        : model_(model), parameters_(parameters), graph_(graph), reads_(TextureProgram::first_read_row) {}

    /// `own`: the place that the function is asked for.
    [[nodiscard]] Surroundings with(std::array<NodeId, 3> own) {
        Surroundings s;
        s.look_up = [this, own](std::string_view name, const std::vector<Value>& given,
                                std::string& why) -> std::optional<Value> {
            const auto image = static_cast<std::size_t>(given[0].nodes[0]);
            if (name == "size" && given.size() == 1)
                return vector_value({graph_.uniform(size_uniform(model_, image, 0)),
                                     graph_.uniform(size_uniform(model_, image, 1))});
            if (name != "lookupLOD" || given.size() != 3) return {};
            if (image >= parameters_.images.size() || parameters_.images[image].width == 0) {
                why = image == model_.parameters().size() ? "the image of the texture is missing"
                                                          : "the image of this texture is missing";
                return {};
            }
            const std::array<NodeId, 3> at{given[1].nodes[0], given[1].nodes[1], given[2].nodes[0]};
            const bool grey = parameters_.images[image].grey;
            Value value = reads_.value(graph_, {image, grey ? 0 : group, at == own, at});
            if (grey) std::fill(value.nodes.begin() + 1, value.nodes.end(), value.nodes[0]);
            return value;
        };
        s.parameter = [this](std::size_t parameter) -> std::optional<Value> {
            if (parameter >= parameters_.channels.size() || parameters_.channels[parameter].empty())
                return {};
            const std::vector<double>& given = parameters_.channels[parameter];
            Value value{Type::vec4, {}};
            for (std::size_t c = 0; c < 4; ++c) {
                const std::size_t band = given.size() == 4 && parameters_.bands != 4
                                             ? c
                                             : std::min(4 * group + c, given.size() - 1);
                value.nodes[c] = graph_.uniform(texture_channel_uniform(model_, parameter, band));
            }
            return value;
        };
        return s;
    }
    [[nodiscard]] const std::vector<LookUp>& reads() const { return reads_.list(); }

    std::size_t group = 0; ///< of four bands

private:
    const Model& model_;
    const TextureParameters& parameters_;
    Graph& graph_;
    LookUps reads_;
};

/// The texture argument `tex`: its number is behind those of the parameters.
Value own_texture(const Model& model) {
    return {Type::texture, {static_cast<NodeId>(model.parameters().size()), -1, -1, -1}};
}

} // namespace

TextureProgram::TextureProgram(std::shared_ptr<const Model> model, const TextureParameters& parameters)
    : model_(std::move(model)),
      at_(texture_function(*model_).at),
      by_position_(model_->function("lookup3D") != nullptr) {
    find_size(parameters);
    compile(parameters);
}

void TextureProgram::find_size(const TextureParameters& parameters) {
    const std::size_t own = model_->parameters().size();
    if (own < parameters.images.size() && parameters.images[own].width > 0)
        size_ = {parameters.images[own].width, parameters.images[own].height};
    const Function* const function = model_->function("textureSize");
    if (function == nullptr) return;
    Graph graph;
    TextureSurroundings surroundings(*model_, parameters, graph);
    const Value value =
        lowered(*model_, *function, parameters, first_read_row, graph, {}, surroundings.with({-1, -1, -1}));
    if (!surroundings.reads().empty()) refuse(*model_, function->at, "textureSize() must not read an image");
    const BoundProgram program =
        bound_program(*model_, function->at, graph, std::span(value.nodes).first(2),
                      texture_uniforms(*model_, parameters), first_read_row, NativeTarget::none);
    std::array<std::array<double, Program::lane_step>, 2> out{};
    const std::array<const double*, first_read_row> none{};
    std::array<double*, 2> to_out{out[0].data(), out[1].data()};
    program.program->run(program.uniforms, none.data(), to_out.data(), Program::lane_step);
    // A size of 0 leaves it to the image.
    if (out[0][0] >= 1 && out[1][0] >= 1) size_ = {out[0][0], out[1][0]};
}

void TextureProgram::compile(const TextureParameters& parameters) {
    Graph graph;
    TextureSurroundings surroundings(*model_, parameters, graph);
    const Value place =
        by_position_
            ? vector_value({texture_row(graph, row_x), texture_row(graph, row_y), texture_row(graph, row_z)})
            : vector_value({texture_row(graph, row_x), texture_row(graph, row_y)});
    Value level = scalar_value(texture_row(graph, row_level));
    if (const Function* const own = model_->function("compute3DLOD"); own != nullptr && by_position_)
        level = lowered(*model_, *own, parameters, first_read_row, graph,
                        {own_texture(*model_), place, scalar_value(texture_row(graph, row_sample_m))},
                        surroundings.with({-1, -1, -1}));
    std::vector<NodeId> outputs;
    for (; 4 * surroundings.group < parameters.bands; ++surroundings.group) {
        const Value result =
            lowered(*model_, texture_function(*model_), parameters, first_read_row, graph,
                    {own_texture(*model_), place, level},
                    surroundings.with({by_position_ ? -1 : place.nodes[0], place.nodes[1], level.nodes[0]}));
        for (std::size_t c = 0; c < 4 && outputs.size() < parameters.bands; ++c)
            outputs.push_back(result.nodes[c]);
    }
    if (std::all_of(outputs.begin(), outputs.end(), [&](NodeId n) { return n == outputs[0]; }))
        outputs.resize(1);
    outputs_ = outputs.size();
    const std::size_t rows = first_read_row + 4 * surroundings.reads().size();
    if (rows > max_rows)
        refuse(*model_, at_,
               fmt::format("images are read {} times in {} bands: allowed are {}",
                           surroundings.reads().size(), parameters.bands, (max_rows - first_read_row) / 4));
    const std::vector<double> uniforms = texture_uniforms(*model_, parameters);
    const auto inputs = static_cast<std::int32_t>(rows);
    bound_ = bound_program(*model_, at_, graph, outputs, uniforms, inputs, parameters.target);
    places_ = LookUpPlaces(*model_, at_, graph, surroundings.reads(), uniforms, inputs, parameters.target);
}

void TextureProgram::evaluate(const double* const* rows, double* const* r, std::size_t lanes) const noexcept {
    bound_.program->run(bound_.uniforms, rows, r, lanes);
}

} // namespace obscura::models
