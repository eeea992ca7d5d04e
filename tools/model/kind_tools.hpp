// SPDX-License-Identifier: Apache-2.0
// What the verbs `obscura model` say of a model, for each kind of model.
#pragma once

#include "models/program/program.hpp"
#include "models/values/model_values.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace obscura::tools {

/// One line of an answer: for people `label` and `text`, for programs `name` and `value`.
struct ModelFact {
    std::string label, text, name;
    nlohmann::json value;
};
using ModelFacts = std::vector<ModelFact>;

/// A model as a program: what it costs.
struct ModelCost {
    std::size_t operations = 0; ///< for each sample
    std::int32_t slots = 0;     ///< values in use at once
    std::string why_interpreted;
    std::vector<models::Instruction> listing;
    ModelFacts facts; ///< others that matter for this kind
    double ns = 0;    ///< of an evaluation on this machine; 0: not measured
};
[[nodiscard]] ModelCost cost_of(const models::Program& program, std::string why_interpreted);

/// What a check of a model that can be read has found.
struct ModelVerdict {
    models::Place at{};                ///< place of what is said: the kind's main function
    std::string refusal;               ///< why it cannot be used; empty: it can
    std::vector<std::string> warnings; ///< a line each
    std::string summary;               ///< of a sound one: "12 operations a sample, ..."
};

/// Value of a property that says in which camera a model is shown; `otherwise` if the text has none. Throws
/// ConfigError if it is not from `min` to `max`.
[[nodiscard]] double property_of(const models::Model& model, std::string_view name, double otherwise,
                                 double min, double max);

/// Numbers of the command line: arguments of the function that is evaluated, by name.
using ModelPoint = std::map<std::string, double, std::less<>>;

/// Argument of `obscura model eval --at NAME=VALUE`.
struct PointArgument {
    std::string_view name, unit, help;
    double value, min, max;
};

/// One kind. Functions throw Error; null: the kind has no such thing.
struct KindTools {
    std::string_view kind;     ///< as in models::model_kinds()
    std::string_view new_text; ///< a model that works; {0}: its name
    ModelCost (*cost)(const models::ModelValues&) = nullptr;
    ModelVerdict (*check)(const models::ModelValues&) = nullptr;
    std::vector<PointArgument> point{}; ///< arguments of eval
    ModelFacts (*eval)(const models::ModelValues&, const ModelPoint&) = nullptr;
    /// Endings of the files that plot() writes, with what each shows.
    std::vector<std::pair<std::string_view, std::string_view>> plots{};
    void (*plot)(const models::ModelValues&, std::string_view title, const std::filesystem::path&) = nullptr;
    /// Nanoseconds a sample: the first of the model, then of what is built in.
    ModelFacts (*bench)(const models::ModelValues&) = nullptr;
};

/// A row for each of models::model_kinds(), in its order.
[[nodiscard]] const std::vector<const KindTools*>& kind_tools();
[[nodiscard]] const KindTools& tools_of(const models::Model& model);

/// Files of the shipped models of all kinds, by kind and name.
[[nodiscard]] std::vector<std::filesystem::path> shipped_model_files();
/// A path, or the shipped model of that name of whatever kind. Throws InputError.
[[nodiscard]] std::filesystem::path model_path(const std::string& name);

/// Reads the model `file`, a path or the name of a shipped one, with `settings`, "NAME=VALUE" each, of its
/// parameters. Throws Error.
[[nodiscard]] models::ModelValues chosen_model(const std::string& file,
                                               const std::vector<std::string>& settings);

/// Least time of 60 runs of `work`, which takes `samples` samples, for one of them.
template<typename Work>
[[nodiscard]] double nanoseconds_a_sample(double samples, const Work& work) {
    double best = std::numeric_limits<double>::infinity();
    for (int repeat = 0; repeat < 60; ++repeat) {
        const auto begin = std::chrono::steady_clock::now();
        work();
        const std::chrono::duration<double, std::nano> took = std::chrono::steady_clock::now() - begin;
        best = std::min(best, took.count() / samples);
    }
    return best;
}

} // namespace obscura::tools
