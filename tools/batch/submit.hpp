// SPDX-License-Identifier: Apache-2.0
// Shell commands that run the unfinished shards of a batch: job arrays of Slurm, and GNU parallel.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::tools {

/// What the commands are made of.
struct SubmitRequest {
    std::string program; ///< of obscura, as the machines see it
    std::string batch;   ///< folder, absolute
    std::vector<std::uint64_t> shards;
    std::uint64_t threads = 1;     ///< of each shard
    std::uint64_t jobs = 0;        ///< GNU parallel: at a time on a machine; 0: one per core
    std::vector<std::string> with; ///< further options of sbatch or parallel, as they are
};

/// Number of tasks in a job array of Slurm, whose indices end at 1000 by default (MaxArraySize 1001).
inline constexpr std::uint64_t slurm_block = 1000;

/// Commands of a shell, one for each block of `slurm_block` shards. A minute before its time is over, obscura
/// itself gets SIGTERM.
[[nodiscard]] std::vector<std::string> slurm_commands(const SubmitRequest& request);
[[nodiscard]] std::vector<std::string> parallel_commands(const SubmitRequest& request);

/// "0-99,200,300-301" of ascending numbers.
[[nodiscard]] std::string ranges_text(const std::vector<std::uint64_t>& numbers);
/// Parses such a list of numbers below `end`; sorted, each once. Throws UsageError, which begins with
/// `option`.
[[nodiscard]] std::vector<std::uint64_t> parse_ranges(std::string_view text, std::uint64_t end,
                                                      std::string_view option);
/// `text` as one word of a POSIX shell.
[[nodiscard]] std::string shell_word(std::string_view text);

} // namespace obscura::tools
