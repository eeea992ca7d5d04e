// SPDX-License-Identifier: Apache-2.0
// Verbs `obscura batch status`, `obscura batch verify` and `obscura batch submit`.
#include "tools/batch/batch_state.hpp"

#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "core/text/printable.hpp"
#include "host/interrupt.hpp"
#include "tools/batch/inputs.hpp"
#include "tools/batch/shard_runner.hpp"
#include "tools/batch/submit.hpp"
#include "tools/check/report.hpp"
#include "tools/scene/progress.hpp"
#include "tools/verbs/batch.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace obscura::tools {
namespace {

void add_to(Report& report, const BatchState& state) {
    const auto whole = [](std::uint64_t n) { return static_cast<std::int64_t>(n); };
    report.add("frames", "frames", whole(state.frames));
    report.add("done", "done", whole(state.done));
    report.add("bad", "with a record, but not as recorded", whole(state.bad.size()));
    report.add("shards", "shards", whole(state.shards));
    report.add("shards_done", "complete", whole(state.shards_done));
    report.add("shards_begun", "begun", whole(state.shards_begun));
    report.add("bytes", "bytes of the frames", whole(state.bytes));
    report.add("hosts", "machines that rendered", whole(state.hosts));
    const std::optional<double> mean =
        state.done > 0 ? std::optional(state.seconds / static_cast<double>(state.done)) : std::nullopt;
    report.add("frame_s", "a frame takes", mean, "s", 3);
}

/// Adds a duration: seconds in JSON.
void add_span(Report& report, std::string_view key, std::string_view label, std::optional<double> seconds) {
    if (seconds)
        report.add(key, label, span_text(*seconds), *seconds);
    else
        report.add(key, label, std::nullopt, "", 0);
}

class BatchStatus final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "shows how far a batch is and how long it will take";
        line.description =
            "Reads the records of all shards and looks at the sizes of the frames' files. "
            "The time left is that of the remaining frames at the rate of all processes in the last 15 minutes. "
            "Exit status 0 if every frame is done, else 1.";
        declare_batch_folder(line, batch_);
        line.flag("--json", json_, "Print the state as one JSON object, with the list of unfinished shards");
        line.examples = {"obscura batch status batch", "obscura batch status batch --json"};
    }

    int run() override {
        const Plan plan = read_plan(batch_);
        const BatchState state = batch_state(plan, batch_, FrameCheck::size, std::time(nullptr));
        Report report;
        add_to(report, state);
        const bool complete = state.done == state.frames;
        report.add("recent", "finished in the last 15 min", static_cast<std::int64_t>(state.recent));
        add_span(report, "left_s", "time left at that rate", complete ? std::optional(0.0) : state.left_s());
        add_span(report, "work_left_s", "work left, one frame after the other", state.work_left_s());
        if (!complete) {
            const std::string unfinished = ranges_text(state.unfinished);
            report.add("unfinished", "unfinished shards",
                       json_ || unfinished.size() < 200 ? unfinished : unfinished.substr(0, 196) + " ...");
        }
        report.print(json_);
        return complete ? exit_ok : exit_failure;
    }

private:
    std::string batch_;
    bool json_ = false;
};

class BatchVerify final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "reads all frames of a batch and compares their SHA-256 with the records";
        line.description =
            "Prints a line for each frame whose file is missing or is not as recorded; obscura batch run makes those anew. "
            "Exit status 0 if every frame of the plan is there and right, else 1.";
        declare_batch_folder(line, batch_);
        line.flag(
            "--inputs", inputs_,
            "Also read the scene and all files that it reads whole; a run reads samples of those beyond 64 MiB");
        line.number("--threads", &threads_, "N", "Threads that read; 0: one per core", 0, 1024);
        line.flag("--json", json_, "Print the figures as one JSON object");
        line.examples = {"obscura batch verify batch && echo complete",
                         "obscura batch verify batch --inputs"};
    }

    [[nodiscard]] std::optional<int> interrupted_status() const override { return exit_interrupted; }

    int run() override {
        const Plan plan = read_plan(batch_);
        if (inputs_) (void)CheckedInputs(plan, InputCheck::whole);
        const BatchState state = batch_state(plan, batch_, FrameCheck::hash, std::time(nullptr), threads_);
        if (host::interrupted()) return exit_interrupted;
        for (const BadFrame& bad : state.bad)
            print_message(fmt::format("{}: frame {} {}", bad.file, bad.frame, bad.why));
        Report report;
        add_to(report, state);
        report.add("missing", "missing", static_cast<std::int64_t>(state.frames - state.done));
        report.print(json_);
        return state.done == state.frames ? exit_ok : exit_failure;
    }

private:
    std::string batch_;
    std::uint32_t threads_ = 0;
    bool inputs_ = false, json_ = false;
};

class BatchSubmit final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "hands the unfinished shards of a batch to Slurm or GNU parallel";
        line.description =
            "Makes the command that runs obscura batch run for each unfinished shard, prints it, and executes it: an array of jobs for Slurm, or GNU parallel on this machine and, with its own options, on others. "
            "All machines must see DIR, the scene and its files under the same names. "
            "Slurm sends SIGTERM a minute before a job's time is over; "
            "what it did not finish is submitted by the next call.";
        declare_batch_folder(line, batch_);
        line.flag("--slurm", slurm_, "Submit an array of jobs with sbatch");
        line.flag("--parallel", parallel_, "Run jobs with GNU parallel, and wait for them");
        line.flag("--dry-run", dry_run_, "Print the command and do not execute it");
        line.number("--threads", &request_.threads, "N", "Render threads of each shard", 1, 1024);
        line.number("--jobs", &request_.jobs, "N",
                    "With --parallel: shards at a time on each machine; 0: one per core", 0, 65536);
        line.option(
            "--with", &request_.with, "TEXT",
            "Further options of sbatch or parallel, as they are, such as \"--partition=long --time=4:00:00\" or \"--sshlogin node1,node2\"; "
            "may be given several times");
        line.examples = {
            "obscura batch submit batch --slurm --with=\"--time=4:00:00 --mem=8G\"",
            "obscura batch submit batch --parallel --jobs 4",
            "obscura batch submit batch --slurm --dry-run",
        };
    }

    int run() override {
        if (slurm_ == parallel_)
            throw host::UsageError("obscura batch submit: allowed is one of --slurm and --parallel");
        const Plan plan = read_plan(batch_);
        const BatchState state = batch_state(plan, batch_, FrameCheck::size, std::time(nullptr));
        if (state.unfinished.empty()) {
            fmt::print("every frame is done\n");
            return exit_ok;
        }
        request_.program = std::filesystem::read_symlink("/proc/self/exe").string();
        request_.batch = real_path(batch_).string();
        request_.shards = state.unfinished;
        for (const std::string& command : slurm_ ? slurm_commands(request_) : parallel_commands(request_)) {
            fmt::print("{}\n", command);
            std::fflush(stdout);
            if (dry_run_) continue;
            if (const int status = std::system(command.c_str()); status != 0)
                throw HardwareError(fmt::format("obscura batch submit: {} ended with status {}",
                                                slurm_ ? "sbatch" : "parallel",
                                                WIFEXITED(status) ? WEXITSTATUS(status) : status));
        }
        return exit_ok;
    }

private:
    std::string batch_;
    SubmitRequest request_;
    bool slurm_ = false, parallel_ = false, dry_run_ = false;
};

} // namespace

std::unique_ptr<Verb> make_batch_status() {
    return std::make_unique<BatchStatus>();
}
std::unique_ptr<Verb> make_batch_verify() {
    return std::make_unique<BatchVerify>();
}
std::unique_ptr<Verb> make_batch_submit() {
    return std::make_unique<BatchSubmit>();
}

} // namespace obscura::tools
