// SPDX-License-Identifier: Apache-2.0
// docs/reference/features.md, the list of GenICam features for people, made from the feature table.
#pragma once

#include "transports/gige/registers/feature.hpp"

#include <span>
#include <string>

namespace obscura::transports::gige {

/// Markdown, one table a category.
[[nodiscard]] std::string feature_page(std::span<const FeatureCategory> table);

} // namespace obscura::transports::gige
