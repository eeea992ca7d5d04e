// SPDX-License-Identifier: Apache-2.0
// Table of a file that names a model written in SuMoL and gives its parameters.
#pragma once

#include "config/section.hpp"
#include "models/values/model_values.hpp"

#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace obscura::models {

/// Key "model" of such a table, bound to `file`.
[[nodiscard]] config::Key model_key(std::string& file);
/// Reads the file of a model of the kind called `kind` alone, since the other keys are the model's. Throws
/// ConfigError.
[[nodiscard]] std::string model_file(const config::Value& table, const config::Where& where,
                                     std::string_view kind);

/// Calls `read(member, where, file)` with the table that `key` has within `table`, its place and the file of
/// the model of the kind called `kind` that it names; what it throws is a mistake of the table. False: the
/// key has no table.
bool read_model_table(
    const config::ReadTable& table, std::string_view key, std::string_view kind,
    const std::function<void(const config::Member&, const config::Where&, std::string&)>& read);

/// Reads the table `key = { model = "FILE", PARAMETER = VALUE }` within `table` as a model of the kind called
/// `kind`; nothing where the key is no table, or after mistakes.
[[nodiscard]] std::optional<ModelValues> read_model(const config::ReadTable& table, std::string_view key,
                                                    std::string_view kind);

/// The model as such a table, with all parameters; empty: `values` has none.
[[nodiscard]] std::string table_text(const ModelValues& values);

} // namespace obscura::models
