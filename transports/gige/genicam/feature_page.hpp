// SPDX-License-Identifier: Apache-2.0
// Reference page of the GenICam features, docs/reference/features.md, made from the feature table.
#pragma once

#include "transports/gige/registers/feature.hpp"

#include <span>
#include <string>

namespace obscura::transports::gige {

/// Text of the page in Markdown, one table per category.
[[nodiscard]] std::string feature_page(std::span<const FeatureCategory> table);

} // namespace obscura::transports::gige
