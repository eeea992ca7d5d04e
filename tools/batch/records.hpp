// SPDX-License-Identifier: Apache-2.0
// Records of rendered frames: shard.jsonl, one JSON object a line, appended by any number of processes.
#pragma once

#include "tools/batch/plan.hpp"

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>

namespace obscura::tools {

/// One rendered frame.
struct FrameRecord {
    std::uint64_t frame = 0;
    std::string file; ///< name in the shard's folder
    host::FileDigest content;
    double seconds = 0;              ///< of rendering and writing
    std::int64_t finished_s = 0;     ///< CLOCK_REALTIME
    std::string host, version, plan; ///< plan: Plan::id
};

/// The record as a line without its end.
[[nodiscard]] std::string record_text(const FrameRecord& record);
/// What a line says; nothing if it is no record, such as a line that was cut short.
[[nodiscard]] std::optional<FrameRecord> parse_record(std::string_view line);

/// Appends a record in one write. Throws OutputError.
void append_record(const std::filesystem::path& file, const FrameRecord& record);

/// The last record of each frame of one shard. Records of other plans, of frames of other shards and with
/// other file names are left out. Thread-bound.
class ShardRecords {
public:
    ShardRecords(const Plan& plan, const std::filesystem::path& batch, std::uint64_t shard);

    /// Reads what was appended since the last call. Throws InputError if the file cannot be read; none is
    /// there before the first frame.
    void update();
    /// Null: the frame has no record.
    [[nodiscard]] const FrameRecord* find(std::uint64_t frame) const;
    [[nodiscard]] const std::map<std::uint64_t, FrameRecord>& all() const noexcept { return records_; }
    /// Frames of which records state different bytes: something outside of the plan changes them.
    [[nodiscard]] const std::set<std::uint64_t>& disputed() const noexcept { return disputed_; }
    [[nodiscard]] const std::filesystem::path& folder() const noexcept { return folder_; }

private:
    void take(std::string_view line);

    const Plan* plan_;
    FrameRange frames_;
    std::filesystem::path folder_;
    std::uint64_t read_ = 0; ///< bytes
    std::map<std::uint64_t, FrameRecord> records_;
    std::set<std::uint64_t> disputed_;
};

/// How closely a frame's file is compared with its record.
enum class FrameCheck {
    size, ///< it is there and has the recorded size
    hash, ///< and the recorded SHA-256
};
/// Why a frame with a record is not done; empty: it is.
[[nodiscard]] std::string explain_not_done(const FrameRecord& record, const std::filesystem::path& folder,
                                           FrameCheck check);

} // namespace obscura::tools
