// SPDX-License-Identifier: Apache-2.0
// Check of gige.xml_values against the feature table, without network and acquisition.
#pragma once

#include "transports/gige/settings.hpp"
#include "transports/transport_settings.hpp"

#include <string>

namespace obscura::transports::gige {

/// Why the features of `settings.xml` do not take `settings.xml_values` on `camera`; empty if they do. Names
/// no key. Reads the file `settings.xml`, which explain_invalid_xml() must have found valid; reads and writes
/// no user sets. Throws ConfigError if the file cannot be bound.
[[nodiscard]] std::string explain_refused_values(const GigeSettings& settings, const CameraFacts& camera);

} // namespace obscura::transports::gige
