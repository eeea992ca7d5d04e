// SPDX-License-Identifier: Apache-2.0
// camera.xml, the GenICam description of the camera, made from the feature table.
#pragma once

#include "transports/gige/registers/feature.hpp"

#include <span>
#include <string>

namespace obscura::transports::gige {

/// Text of the file by the GenApi schema 1.1. The same table gives the same bytes. Throws std::logic_error
/// when a row refers to another that does not exist.
[[nodiscard]] std::string describe_camera(std::span<const FeatureCategory> table);

} // namespace obscura::transports::gige
