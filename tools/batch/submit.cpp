// SPDX-License-Identifier: Apache-2.0
#include "tools/batch/submit.hpp"

#include "host/command_line.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <set>

namespace obscura::tools {
namespace {

/// Calls `take(first, last)` for each run of consecutive numbers.
template<typename F>
void for_each_run(const std::vector<std::uint64_t>& numbers, F&& take) {
    for (std::size_t i = 0; i < numbers.size();) {
        std::size_t end = i + 1;
        while (end < numbers.size() && numbers[end] == numbers[end - 1] + 1)
            ++end;
        take(numbers[i], numbers[end - 1]);
        i = end;
    }
}

std::string run_command(const SubmitRequest& request, std::string_view shard) {
    return fmt::format("{} batch run {} --threads {} --shard {}", shell_word(request.program),
                       shell_word(request.batch), request.threads, shard);
}

std::string with_text(const SubmitRequest& request) {
    std::string text;
    for (const std::string& option : request.with)
        text += " " + option;
    return text;
}

} // namespace

std::vector<std::string> slurm_commands(const SubmitRequest& request) {
    std::map<std::uint64_t, std::vector<std::uint64_t>> blocks;
    for (const std::uint64_t shard : request.shards)
        blocks[shard / slurm_block].push_back(shard % slurm_block);
    std::vector<std::string> commands;
    for (const auto& [block, tasks] : blocks) {
        const std::string shard = block == 0
                                      ? "$SLURM_ARRAY_TASK_ID"
                                      : fmt::format("$((SLURM_ARRAY_TASK_ID + {}))", block * slurm_block);
        // With exec the batch process, which gets the signal, is obscura and not a shell that waits for it.
        commands.push_back(fmt::format(
            "sbatch --array={} --job-name=obscura --cpus-per-task={} --signal=B:TERM@60 --requeue --output={}{} --wrap={}",
            ranges_text(tasks), request.threads, shell_word(request.batch + "/slurm-%A_%a.log"),
            with_text(request), shell_word("exec " + run_command(request, shard))));
    }
    return commands;
}

std::vector<std::string> parallel_commands(const SubmitRequest& request) {
    if (request.shards.empty()) return {};
    std::string list;
    for_each_run(request.shards, [&list](std::uint64_t first, std::uint64_t last) {
        list += fmt::format("{}seq {} {}", list.empty() ? "" : "; ", first, last);
    });
    const std::string jobs = request.jobs > 0 ? fmt::format(" --jobs {}", request.jobs) : "";
    return {fmt::format("({}) | parallel{} --joblog {} --halt soon,fail=3{} {}", list, jobs,
                        shell_word(request.batch + "/parallel.log"), with_text(request),
                        shell_word(run_command(request, "{}")))};
}

std::string ranges_text(const std::vector<std::uint64_t>& numbers) {
    std::string text;
    for_each_run(numbers, [&text](std::uint64_t first, std::uint64_t last) {
        text += fmt::format("{}{}", text.empty() ? "" : ",", first);
        if (last > first) text += fmt::format("-{}", last);
    });
    return text;
}

std::vector<std::uint64_t> parse_ranges(std::string_view text, std::uint64_t end, std::string_view option) {
    std::set<std::uint64_t> numbers;
    const auto number = [](std::string_view digits, std::uint64_t& value) {
        const auto [stop, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
        return error == std::errc{} && stop == digits.data() + digits.size();
    };
    bool good = !text.empty();
    for (std::string_view left = text; good && !left.empty();) {
        const std::string_view item = left.substr(0, left.find(','));
        left.remove_prefix(std::min(left.size(), item.size() + 1));
        const std::size_t dash = item.find('-');
        std::uint64_t first = 0, last = 0;
        good = number(item.substr(0, dash), first);
        last = first;
        if (good && dash != std::string_view::npos) good = number(item.substr(dash + 1), last);
        good = good && first <= last && last < end;
        for (std::uint64_t i = first; good && i <= last; ++i)
            numbers.insert(i);
    }
    if (!good)
        throw host::UsageError(fmt::format("{} \"{}\": allowed are numbers from 0 to {}, such as 7 or 0-9,12",
                                           option, text.substr(0, 60), end - 1));
    return {numbers.begin(), numbers.end()};
}

std::string shell_word(std::string_view text) {
    constexpr std::string_view plain =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_./:@%+=,";
    if (!text.empty() && text.find_first_not_of(plain) == std::string_view::npos) return std::string(text);
    std::string out = "'";
    for (const char c : text)
        out += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return out + "'";
}

} // namespace obscura::tools
