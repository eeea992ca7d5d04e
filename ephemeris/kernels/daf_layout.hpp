// SPDX-License-Identifier: Apache-2.0
// Layout of DAF files: records, test of their transfer (NAIF, DAF Required Reading).
#pragma once

#include <cstddef>
#include <string_view>

namespace obscura::ephemeris {

inline constexpr std::size_t record_bytes = 1024;
/// Bytes that a transfer in text mode would change, at byte 699 of the file record.
inline constexpr std::size_t ftp_offset = 699;
inline constexpr std::string_view ftp_string{"FTPSTR:\r:\n:\r\n:\r\0:\x81:\x10\xCE:ENDFTP", 28};

} // namespace obscura::ephemeris
