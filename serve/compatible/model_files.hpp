// SPDX-License-Identifier: Apache-2.0
// Models in SuMoL that the published client names.
#pragma once

#include "serve/compatible/parameters.hpp"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <string_view>

namespace obscura::serve::compatible {

/// The table of a scene file, { model = FILE, PARAMETER = VALUE }, for the model of the kind called `kind` in
/// `file`. Throws Failure; `wanted`: what the file should be.
[[nodiscard]] nlohmann::json table_of_model(Request& r, const std::filesystem::path& file,
                                            std::string_view kind, std::string_view wanted,
                                            Parameters& parameters);

} // namespace obscura::serve::compatible
