// SPDX-License-Identifier: Apache-2.0
// State file of the GigE Vision device: DeviceUserID and user sets on disk, as TOML with a checksum.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace obscura::transports::gige {

/// A register and the word that a user set holds for it.
struct SavedWord {
    std::uint32_t address = 0, word = 0;
    constexpr bool operator==(const SavedWord&) const = default;
};

/// What outlives the device.
struct DeviceState {
    std::string user_id;                ///< DeviceUserID, printable ASCII
    std::uint32_t user_set_default = 0; ///< UserSetDefault
    std::vector<SavedWord> user_set_1;  ///< by address; empty: never saved
    bool operator==(const DeviceState&) const = default;
};

/// `state` as the text of a state file; the last line holds the CRC-32 (ISO 3309) of the lines before it.
[[nodiscard]] std::string format_state(const DeviceState& state);

/// Reads a state file. Returns an empty string and fills `state`, or leaves `state` alone and returns why the
/// file cannot be used, in one line without the name of the file: not a regular file, too large, changed
/// since it was written, not a state file, not readable. A file that does not exist gives an empty state.
[[nodiscard]] std::string read_state(const std::string& file, DeviceState& state);

/// Replaces `file` atomically. Returns an empty string, or why it could not be written. Blocks for the disk.
[[nodiscard]] std::string write_state(const std::string& file, const DeviceState& state);

} // namespace obscura::transports::gige
