// SPDX-License-Identifier: Apache-2.0
#include "models/values/model_values.hpp"

#include "core/error.hpp"
#include "models/model/entry_points.hpp"
#include "models/values/model_use.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace obscura::models {
namespace {

const ModelKind& model_kind(std::string_view name) {
    const auto& kinds = model_kinds();
    return *std::find_if(kinds.begin(), kinds.end(),
                         [&](const ModelKind& kind) { return kind.name == name; });
}

} // namespace

std::shared_ptr<const LoadedModel> load_model(const std::string& file, std::string_view kind) {
    const Execution& execution = UseModels::current().execution;
    std::shared_ptr<const Model> model;
    execution.make([&] { model = Model::load(file); });
    const ModelKind* const found = kind_of(*model);
    if (!kind.empty() && found->name != kind)
        throw ConfigError(fmt::format("{}: a {} model: a {} needs one that ends in {}", file, found->name,
                                      kind, model_kind(kind).ending));
    return loaded_model(std::move(model), execution);
}

std::shared_ptr<const LoadedModel> loaded_model(std::shared_ptr<const Model> model, Execution execution) {
    auto loaded = std::make_shared<LoadedModel>();
    loaded->model = std::move(model);
    loaded->execution = std::move(execution);
    for (const Parameter& p : loaded->model->parameters()) {
        loaded->keys.push_back(p.si() != 1 ? fmt::format("{}_{}", p.name, p.unit) : std::string(p.name));
        loaded->helps.push_back(p.help.empty() ? fmt::format("Parameter of {}", loaded->model->name())
                                               : std::string(p.help));
    }
    return loaded;
}

config::ShippedFolder shipped_models(std::string_view kind) {
    const ModelKind& row = model_kind(kind);
    return {"models", row.ending, row.title};
}

ModelValues defaults_of(std::shared_ptr<const LoadedModel> loaded) {
    ModelValues p;
    ModelParameters defaults = default_parameters(*loaded->model);
    p.values = std::move(defaults.values);
    p.channels = std::move(defaults.channels);
    p.loaded = std::move(loaded);
    return p;
}

config::Key parameter_key(ModelValues& p, std::size_t index, const config::Value* table) {
    const Parameter& parameter = p.loaded->model->parameters()[index];
    double* const first = p.values[index].data();
    const int count = components(parameter.type);
    const bool one = count <= 1 || parameter.type == Type::vec4;
    const double si = parameter.si();
    const config::Member* const given = table != nullptr ? table->find(p.loaded->keys[index]) : nullptr;
    const bool list =
        parameter.type == Type::vec4 && given != nullptr && given->value.kind == config::Value::Kind::array;
    // One number stands for all channels.
    if (given != nullptr && !list) p.channels[index].clear();
    const config::Target target =
        list      ? config::Target(&p.channels[index])
        : !one    ? config::Target(config::Numbers{first, static_cast<std::size_t>(count)})
        : si != 1 ? config::Target(config::Scaled{first, si})
                  : config::Target(first);
    return config::key(p.loaded->keys[index], target)
        .unit(parameter.unit)
        .range(parameter.min, parameter.max)
        .help(p.loaded->helps[index]);
}

config::Keys parameter_keys(ModelValues& p, const config::Value* table) {
    config::Keys keys;
    for (std::size_t i = 0; i < p.values.size(); ++i)
        if (!p.loaded->model->parameters()[i].global) keys.push_back(parameter_key(p, i, table));
    return keys;
}

std::string explain_channels(const ModelValues& p, std::size_t bands) {
    for (std::size_t i = 0; i < p.channels.size(); ++i) {
        const std::size_t count = p.channels[i].size();
        if (p.loaded->model->parameters()[i].type == Type::vec4 && count > 1 && count != 4 && count != bands)
            return fmt::format("{}: {} numbers: allowed are 1, 4 or one for each of the {} bands",
                               p.loaded->keys[i], count, bands);
    }
    return "";
}

void apply_globals(const std::vector<Global>& globals, ModelValues& p) {
    if (p.loaded == nullptr) return;
    const auto& parameters = p.loaded->model->parameters();
    for (std::size_t i = 0; i < parameters.size(); ++i) {
        const Parameter& parameter = parameters[i];
        const auto found = std::find_if(globals.begin(), globals.end(),
                                        [&](const Global& g) { return g.name == parameter.name; });
        if (!parameter.global || found == globals.end()) continue;
        const auto count = static_cast<std::size_t>(components(parameter.type));
        const std::vector<double>& given = found->values;
        if (given.size() != 1 && given.size() != count)
            throw ConfigError(fmt::format("global \"{}\": {} numbers: {} has {}", found->name, given.size(),
                                          p.loaded->model->name(), count));
        std::vector<double> values;
        for (std::size_t c = 0; c < count; ++c) {
            values.push_back(given[given.size() == 1 ? 0 : c] * parameter.si());
            if (values[c] < parameter.min * parameter.si() || values[c] > parameter.max * parameter.si())
                throw ConfigError(fmt::format("global \"{}\": {}: {} allows {} to {}", found->name,
                                              given[given.size() == 1 ? 0 : c], p.loaded->model->name(),
                                              parameter.min, parameter.max));
        }
        std::copy(values.begin(), values.end(), p.values[i].begin());
        p.channels[i] = parameter.type == Type::vec4 ? values : std::vector<double>();
    }
}

config::Key shininess_key(ModelValues& p) {
    return config::key("shininess", &p.shininess).range(0, 1e6).help("Argument `shininess` of brdf()");
}

ModelParameters program_parameters(const ModelValues& p) {
    ModelParameters parameters;
    parameters.target = p.loaded->execution;
    parameters.values = p.values;
    parameters.channels = p.channels;
    for (std::size_t i = 0; i < parameters.values.size(); ++i)
        if (p.loaded->model->parameters()[i].type == Type::vec4) parameters.values[i].fill(p.values[i][0]);
    return parameters;
}

} // namespace obscura::models
