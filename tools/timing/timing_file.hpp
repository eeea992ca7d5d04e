// SPDX-License-Identifier: Apache-2.0
// Timing file of a run, as obscurad --timing writes it.
#pragma once

#include "core/camera/frame_record.hpp"

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

namespace obscura::tools {

/// One frame of a timing file. What older files do not have is 0, but for the acquisition.
struct TimingRow : FrameRecord {
    std::string levels;                              ///< a digit for each group of rows: QualityLevel
    std::vector<std::int64_t> first_byte, last_byte; ///< transmit times, by TimingFile::transports
    std::vector<std::int64_t> pace;                  ///< see Transport::pace_ns(), by TimingFile::transports
    std::vector<std::int32_t> row_lateness_us;       ///< how long after its time each row left
};

struct TimingFile {
    std::vector<std::string> transports; ///< kinds, in the order of the file's columns
    std::vector<TimingRow> rows;
};

/// Reads columns by their names in the first line, in any order; columns that it does not know are left out.
/// Throws InputError with file and line; it names a column that is missing. `name` is used in messages.
[[nodiscard]] TimingFile read_timing(std::istream& in, const std::string& name);

/// The frames of each acquisition, in the order of the file.
[[nodiscard]] std::vector<TimingFile> acquisitions(const TimingFile& file);

} // namespace obscura::tools
