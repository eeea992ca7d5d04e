// SPDX-License-Identifier: Apache-2.0
// User sets: the words of all saved features, in memory and in the state file.
#pragma once

#include "transports/gige/device/device_context.hpp"

#include <vector>

namespace obscura::transports::gige {

/// Every saved register with its word, by address.
[[nodiscard]] std::vector<SavedWord> saved_features(const DeviceContext& d);
/// Writes a result of saved_features(); registers that refuse their word keep their value. WRITE_PROTECT
/// during acquisition.
Status load_features(DeviceContext& d, const std::vector<SavedWord>& set);
/// Loads the set that UserSetDefault names, as at the start.
Status load_default_set(DeviceContext& d);
/// DeviceUserID, UserSetDefault and UserSet1 from settings.state_file; loads UserSet1 if it is the default.
/// Words are checked as those that clients write. A file that cannot be used is logged and never replaced.
void read_state_file(DeviceContext& d);
/// Returns false if the file cannot be written, which is logged, or could not be used at start.
bool write_state_file(DeviceContext& d);

} // namespace obscura::transports::gige
