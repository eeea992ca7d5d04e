// SPDX-License-Identifier: Apache-2.0
// Values of features that a user gives beside the description of another camera.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace obscura::transports::gige {

/// One "Feature=value" of a list; `value` is empty and `has_value` false where the = is missing.
struct XmlPreset {
    std::string item, name, value;
    bool has_value = false;
};

/// One element of a list "Feature=value, Feature=value".
std::vector<XmlPreset> xml_presets_of(const std::string& values);

std::string explain_bad_preset(const XmlPreset& preset, std::string_view why, const std::string& file);

} // namespace obscura::transports::gige
