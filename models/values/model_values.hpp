// SPDX-License-Identifier: Apache-2.0
// A model written in SuMoL with values of its parameters, as a scene holds it.
#pragma once

#include "config/keys.hpp"
#include "config/shipped_files.hpp"
#include "models/kinds/model_parameters.hpp"
#include "models/model/model.hpp"

#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::models {

/// A model with the names of its parameters as keys. Immutable; thread-safe.
struct LoadedModel {
    std::shared_ptr<const Model> model;
    std::vector<std::string> keys;  ///< of Model::parameters(): name, and the unit "deg" at its end
    std::vector<std::string> helps; ///< of the keys
    Execution execution{};          ///< of its programs
};
/// Reads a file, whose model is of the kind called `kind`; "": of any. Throws ConfigError or InputError.
[[nodiscard]] std::shared_ptr<const LoadedModel> load_model(const std::string& file,
                                                            std::string_view kind = "");

/// A model that was read elsewhere.
[[nodiscard]] std::shared_ptr<const LoadedModel> loaded_model(std::shared_ptr<const Model> model,
                                                              Execution execution);

/// Shipped models of a kind.
[[nodiscard]] config::ShippedFolder shipped_models(std::string_view kind);

/// Value of the globals of that name of all models of a scene.
struct Global {
    std::string name;
    std::vector<double> values; ///< one for each component, or one for all
};

/// Values of the parameters of a model.
struct ModelValues {
    std::shared_ptr<const LoadedModel> loaded; ///< null: none
    /// Four for each of Model::parameters(), angles in radians; textures are 1.
    std::vector<std::array<double, 4>> values;
    /// Values of a vec4 whose channels differ, 4 or one for each band, for each of Model::parameters();
    /// empty: the first of `values` is that of all channels.
    std::vector<std::vector<double>> channels{};
    double shininess = 1; ///< argument of brdf(), for materials
};
/// With the defaults of `loaded`.
[[nodiscard]] ModelValues defaults_of(std::shared_ptr<const LoadedModel> loaded);

/// Key of the parameter with that index, bound to `p`: name, unit, range and help as the text declares them.
/// `table`: what is to be read, where a vec4 has one number or several; null: one.
[[nodiscard]] config::Key parameter_key(ModelValues& p, std::size_t index,
                                        const config::Value* table = nullptr);
/// Keys of all parameters but globals, for kinds that have no textures.
[[nodiscard]] config::Keys parameter_keys(ModelValues& p, const config::Value* table = nullptr);
/// Why the channels of a vec4 do not suit a scene of so many bands; empty: they do.
[[nodiscard]] std::string explain_channels(const ModelValues& p, std::size_t bands);

/// Sets the globals of a model to those of the scene. Throws ConfigError: the wrong number of values.
void apply_globals(const std::vector<Global>& globals, ModelValues& p);

/// Key of the shininess, for materials.
[[nodiscard]] config::Key shininess_key(ModelValues& p);

/// For a program of the model.
[[nodiscard]] ModelParameters program_parameters(const ModelValues& p);

} // namespace obscura::models
