// SPDX-License-Identifier: Apache-2.0
// Plan of a batch: frames of a scene, divided into shards that are rendered independently; its file
// plan.json.
#pragma once

#include "host/sha256.hpp"
#include "tools/scene/render_options.hpp"
#include "tools/scene/scene_frames.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::tools {

/// A file that the frames depend on.
struct PlannedInput {
    std::string file; ///< absolute, without "..", "." and links
    host::FileDigest whole;
    std::string sampled_sha256; ///< sampled_digest_of(); empty up to `sampled_above`
};

/// Frames from `first` to `last`, numbers from 1 as `obscura render` counts them.
struct FrameRange {
    std::uint64_t first = 1, last = 1;

    bool operator==(const FrameRange&) const = default;
    [[nodiscard]] std::uint64_t count() const noexcept { return last - first + 1; }
};

/// What a batch renders. The bytes of each frame follow from it.
struct Plan {
    std::string version; ///< of the program that made it; no other renders it
    PlannedInput scene;
    std::vector<PlannedInput> assets; ///< files that the scene reads
    RenderOptions render;
    SceneFileFormat format = SceneFileFormat::exr;
    FrameRange frames;
    std::uint64_t shard_frames = 100; ///< the last shard may have fewer
    std::string id;                   ///< SHA-256 of plan.json, which every record of a frame bears

    [[nodiscard]] std::uint64_t shards() const noexcept {
        return (frames.count() + shard_frames - 1) / shard_frames;
    }
    /// `shard` counts from 0.
    [[nodiscard]] FrameRange frames_of(std::uint64_t shard) const noexcept;
    /// "frame_000042.exr".
    [[nodiscard]] std::string file_name(std::uint64_t frame) const;
};

/// Largest number of a frame, and number of shards.
inline constexpr std::uint64_t max_frames = 100'000'000, max_shards = 1'000'000;
/// Frames in a shard, unless the user wants another number: at most 1000 shards, as a job array of Slurm has
/// no more by default, and start-up is a small part of a shard.
[[nodiscard]] std::uint64_t usual_shard_frames(std::uint64_t frames);

/// Names in the folder of a batch.
inline constexpr std::string_view plan_name = "plan.json", records_name = "shard.jsonl";
/// "shards/00042".
[[nodiscard]] std::filesystem::path shard_folder(const std::filesystem::path& batch, std::uint64_t shard);

/// Content of plan.json.
[[nodiscard]] std::string plan_text(const Plan& plan);
/// Parses plan.json; `name` stands for the file in messages. Throws InputError with one line: file, place,
/// cause and what is allowed.
[[nodiscard]] Plan parse_plan(std::string_view text, const std::string& name);
/// Reads `batch`/plan.json. Throws InputError.
[[nodiscard]] Plan read_plan(const std::filesystem::path& batch);

} // namespace obscura::tools
