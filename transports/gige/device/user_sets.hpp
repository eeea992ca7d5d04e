// SPDX-License-Identifier: Apache-2.0
// User sets: the saved features as text, in memory and in the state file.
#pragma once

#include "transports/gige/device/device_context.hpp"

#include <string>

namespace obscura::transports::gige {

/// Every saved register as "address value" lines in hexadecimal, by address.
[[nodiscard]] std::string saved_features(const DeviceContext& d);
/// Writes a result of saved_features(); registers that refuse their word keep their value. WRITE_PROTECT
/// during acquisition.
Status load_features(DeviceContext& d, const std::string& text);
/// DeviceUserID, UserSetDefault and UserSet1 from settings.state_file; loads UserSet1 if it is the default.
void read_state_file(DeviceContext& d);
/// False when the file cannot be written.
bool write_state_file(const DeviceContext& d);

} // namespace obscura::transports::gige
