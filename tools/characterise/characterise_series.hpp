// SPDX-License-Identifier: Apache-2.0
// EMVA 1288 characterisation of a recorded image series.
#pragma once

#include "tools/characterise/characterise_report.hpp"

#include <filesystem>

namespace obscura::tools {

/// Evaluates the series of a descriptor file or its folder, see read_emva_series(). DSNU1288 and PRNU1288
/// come from the stacks at 50 % of saturation and in the dark; without stacks from the pairs. Throws
/// InputError.
[[nodiscard]] Characterisation characterise_series(const std::filesystem::path& folder_or_descriptor);

} // namespace obscura::tools
