// SPDX-License-Identifier: Apache-2.0
// Rendering of the frames of a shard that are not done yet; any number of processes may work on one shard.
#pragma once

#include "tools/batch/inputs.hpp"
#include "tools/batch/plan.hpp"
#include "tools/batch/records.hpp"
#include "tools/scene/scene_frames.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace obscura::tools {

/// Exit status of a run that a signal ended: the rest can be done later (EX_TEMPFAIL of sysexits.h).
inline constexpr int exit_interrupted = 75;

/// Runs shards of one batch, one after the other; scene and assets are read once, and only if a frame is
/// missing. Thread-bound.
class ShardRunner {
public:
    /// `threads`: render threads; 0: one per core. Throws Error, also if this is not the plan's version.
    ShardRunner(Plan plan, std::filesystem::path batch, FrameCheck check, std::uint32_t threads);

    /// Frames of the shards that were run.
    struct Counts {
        std::uint64_t present = 0;  ///< done before
        std::uint64_t rendered = 0; ///< made by this process
    };
    /// Renders what is missing of `shard`; `frame_done` is called after each of its frames. Returns false
    /// when interrupted, without the frame in progress. Throws OutputError if a file cannot be written,
    /// InputError if scene or assets are not those of the plan.
    bool run(std::uint64_t shard, const std::function<void()>& frame_done);
    [[nodiscard]] const Counts& counts() const noexcept { return counts_; }
    [[nodiscard]] const Plan& plan() const noexcept { return plan_; }

private:
    void prepare();
    [[nodiscard]] bool is_done(ShardRecords& records, std::uint64_t frame) const;
    bool render(const ShardRecords& records, std::uint64_t frame);

    Plan plan_;
    std::filesystem::path batch_;
    FrameCheck check_;
    std::string host_;
    Counts counts_;
    std::optional<CheckedInputs> inputs_;
    std::unique_ptr<SceneFrames> frames_; ///< null: nothing was missing so far
};

/// Name of this machine in records and names of temporary files: letters, digits, "-", "_" and ".".
[[nodiscard]] std::string host_name();

/// The program's version, which plans and records bear.
[[nodiscard]] std::string program_version();

} // namespace obscura::tools
