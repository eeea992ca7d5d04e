// SPDX-License-Identifier: Apache-2.0
// Check of the text of a model: findings, parameters, cost and pictures, for any kind.
#pragma once

#include "models/language/findings.hpp"
#include "models/values/model_use.hpp"

#include <nlohmann/json.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace obscura::emulator {

/// What is found in a text, as the answer to "model.check" has it.
struct ModelExamination {
    bool sound = false; ///< without errors
    std::vector<models::Finding> findings;
    std::string summary;                                 ///< of a sound one; one line
    nlohmann::json cost = nlohmann::json::object();      ///< empty: it cannot be run
    nlohmann::json parameters = nlohmann::json::array(); ///< empty: it cannot be read
    std::vector<std::string> plots{};                    ///< endings of pictures that plot_of() makes
    [[nodiscard]] std::string first_error(const std::string& name) const; ///< `NAME:LINE:COLUMN: what`
};

/// Examines `text` as that of a file called `name`, with its default parameters. Takes some ms.
[[nodiscard]] ModelExamination examine_model(const std::string& name, const std::string& text,
                                             const models::Execution& execution);

/// Words of the language for editors: keywords, functions (with those that read textures) and constants.
[[nodiscard]] nlohmann::json model_words();

/// Bytes of the picture that `obscura model plot` makes of a text, in a file of `ending`, one of
/// ModelExamination::plots. Throws Error.
[[nodiscard]] std::string plot_of(const std::string& name, const std::string& text, const std::string& ending,
                                  const models::Execution& execution);

} // namespace obscura::emulator
