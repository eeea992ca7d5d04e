// SPDX-License-Identifier: Apache-2.0
// Kinds of models, and the functions that each has for the renderer.
#pragma once

#include "models/language/findings.hpp"
#include "models/language/syntax.hpp"
#include "models/lowering/value.hpp"

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::models {

class Model;

/// Argument of an entry point.
struct EntryArgument {
    Type type;
    std::string_view name; ///< as documents call it; a model may name it otherwise
};

/// A function that the renderer calls. Of the arguments the first `required` are always there; the rest ends
/// at one of `stops`.
struct EntryPoint {
    std::string_view name;
    Type type;
    std::vector<EntryArgument> arguments;
    std::vector<std::size_t> stops; ///< allowed numbers of arguments, in rising order
    bool required = false;
    std::string_view help;
    bool one_of = false; ///< one of the functions of the kind that say so is required
    /// How messages write it, for arguments that are others by their number; empty: as the arguments say.
    std::string_view written{};
};

/// A function that reads a texture.
struct LookUpFunction {
    std::string_view name;
    std::vector<Type> arguments;
    Type type;
};

struct ModelKind {
    std::string_view name;   ///< "material"
    std::string_view title;  ///< "material model", for messages
    std::string_view ending; ///< of files: ".brdf"
    std::string_view help;
    std::vector<EntryPoint> entry_points;
    std::vector<LookUpFunction> look_ups{};
    std::vector<EntryArgument> constants{}; ///< names that the renderer gives, as "focal_length"
};

[[nodiscard]] const std::vector<ModelKind>& model_kinds();
/// The kind of a model by the ending of its name; null: none.
[[nodiscard]] const ModelKind* kind_of_file(std::string_view name);
[[nodiscard]] const ModelKind* kind_of(const Model& model);

/// Why no kind has the ending of the name; empty: one has.
[[nodiscard]] std::string unknown_ending(std::string_view name);

/// Notes what the functions of `model` lack for its kind.
void check_entry_points(const Model& model, Findings& findings);

/// A value of the type that a function which reads textures returns, for checks of a text by itself.
[[nodiscard]] std::optional<Value> look_up_stand_in(const Model& model, std::string_view name,
                                                    const std::vector<Value>& arguments, std::string& why,
                                                    const std::function<Value(Type)>& placed);

} // namespace obscura::models
