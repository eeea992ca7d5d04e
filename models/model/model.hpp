// SPDX-License-Identifier: Apache-2.0
// A model that a user has written in SuMoL: its text, parameters, properties and functions.
#pragma once

#include "core/units.hpp"
#include "models/language/findings.hpp"
#include "models/language/syntax.hpp"
#include "models/lowering/value.hpp"

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::models {

/// Parameter or global of a model, as keys, listings and editors show it. Texts point into the model.
struct Parameter {
    std::string_view name;
    Type type = Type::scalar;
    bool global = false;
    std::array<double, 4> value{}; ///< default, in `unit`
    std::string_view unit{};       ///< as the text names it; empty: none
    double min = -std::numeric_limits<double>::infinity();
    double max = std::numeric_limits<double>::infinity();
    std::string_view help{};
    Place at{};

    /// Factor from `unit` to what the text sees: angles in degrees are radians there.
    [[nodiscard]] double si() const noexcept { return unit == "deg" ? degree : 1; }
};

/// A value that a model tells the renderer about itself.
struct Property {
    std::string_view name;
    double value = 0;
    Place at;
};

/// The first line of a text, if it is a comment, without its slashes; printable, at most 100 characters.
[[nodiscard]] std::string title_comment(std::string_view text);

/// Immutable; thread-safe. Parameters point into the text, so it stays where it was made.
class Model {
public:
    /// Reads the file, whose ending names the kind. Throws InputError: not readable; ConfigError with all
    /// mistakes of the text, a line each: `file:line:column: what`.
    [[nodiscard]] static std::shared_ptr<const Model> load(const std::filesystem::path& file);
    /// A text as that of a file called `name`.
    [[nodiscard]] static std::shared_ptr<const Model> parse(std::string name, std::string text);

    /// As parse(), with all that was found in `findings`; null if there are errors.
    [[nodiscard]] static std::shared_ptr<const Model> read(std::string name, std::string text,
                                                           Findings& findings);

    Model(const Model&) = delete;
    Model& operator=(const Model&) = delete;

    [[nodiscard]] const std::string& name() const noexcept { return name_; }
    [[nodiscard]] const std::string& text() const noexcept { return text_; }
    [[nodiscard]] const std::vector<Parameter>& parameters() const noexcept { return parameters_; }
    [[nodiscard]] const std::vector<Property>& properties() const noexcept { return properties_; }
    [[nodiscard]] const SyntaxTree& tree() const noexcept { return tree_; }
    [[nodiscard]] const Function* function(std::string_view name) const noexcept;
    /// `file:line:column: what` a line for each; empty: none.
    [[nodiscard]] const std::string& warnings() const noexcept { return warnings_; }

private:
    Model() = default;
    void read_declarations(Findings& findings);
    void check_functions(Findings& findings) const;

    std::string name_, text_, warnings_;
    SyntaxTree tree_;
    std::vector<Parameter> parameters_;
    std::vector<Property> properties_;
};

} // namespace obscura::models
