// SPDX-License-Identifier: Apache-2.0
// Verbs `obscura batch plan` and `obscura batch run`.
#include "tools/verbs/batch.hpp"

#include "config/document.hpp"
#include "config/shipped_files.hpp"
#include "core/io/input_file.hpp"
#include "core/text/printable.hpp"
#include "images/writers/pending_file.hpp"
#include "images/writers/raw.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "tools/batch/inputs.hpp"
#include "tools/batch/plan.hpp"
#include "tools/batch/shard_runner.hpp"
#include "tools/batch/submit.hpp"
#include "tools/check/plausibility.hpp"
#include "tools/check/report.hpp"
#include "tools/scene/progress.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdint>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

namespace obscura::tools {
namespace {

class BatchPlan final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "divides the frames of a scene into shards for many machines";
        line.description =
            "Writes DIR/plan.json: the frames, the options that they are rendered with, the shards, and the SHA-256 of the scene file and of every file that it reads. obscura batch run then renders one shard, on any machine that sees DIR and those files under the same names. "
            "A frame of a batch is byte for byte the one that obscura render makes with the same options.";
        line.positional("SCENE", &scene_, "Scene file (TOML), or the name of a shipped scene");
        line.option(
            "--frames", &frames_, "A:B",
            "Frames of the sequence after the first A, up to the B-th: 0:46000 are all of 46,000, 100:200 are numbers 101 to 200. "
            "B alone: from the first on. Default with --trajectory: all of its samples");
        line.number("--shard", &shard_frames_, "N",
                    "Frames in a shard; 0: 100, or as many as make 1000 shards if that is more", 0,
                    static_cast<double>(max_frames));
        line.option("-o,--out", &out_, "DIR", "Folder for plan, frames and records; created when missing")
            .required = true;
        line.option("--format", &format_, "FORMAT", "File format of the frames").choices = {"exr", "fits"};
        options_.declare(line, "replaces --time and --step");
        line.flag("--json", json_, "Print the figures of the plan as one JSON object");
        line.examples = {
            "obscura batch plan config/scenes/demo.toml --frames 0:46000 --shard 100 --out batch --step 0.1",
            "obscura batch plan flyby.toml --trajectory --samples 64 --layers --out batch",
            "obscura batch run batch                              # all of it, on this machine",
        };
    }

    int run() override {
        options_.check();
        const std::filesystem::path file = config::file_or_shipped(config::shipped_scenes, scene_);
        Plan plan;
        plan.version = program_version();
        plan.format = enum_named<SceneFileFormat>(format_).value();
        plan.render = options_;
        const InputRecord record;
        scene::Scene scene = scene::load_scene(file);
        options_.resize(scene);
        set_frames(scene, plan);
        // Reads the other files of the scene, and finds out what is wrong with them before a thousand
        // machines do.
        const SceneFrames frames(std::move(scene), options_, "obscura batch plan");
        Plausibility view("", frames.renderer(), some_times(frames.camera(), plan.frames));
        view.warn("batch plan");
        plan_inputs(file, record, plan);
        write(plan);

        const auto bytes_of = [](std::uint64_t sum, const PlannedInput& asset) {
            return sum + asset.whole.bytes;
        };
        Report report;
        report.add("plan", "plan", (std::filesystem::path(out_) / plan_name).string());
        report.add("frames", "frames", static_cast<std::int64_t>(plan.frames.count()));
        report.add("shards", "shards", static_cast<std::int64_t>(plan.shards()));
        report.add("shard_frames", "frames in a shard", static_cast<std::int64_t>(plan.shard_frames));
        report.add("assets", "files that the scene reads", static_cast<std::int64_t>(plan.assets.size()));
        report.add("asset_bytes", "their bytes",
                   static_cast<std::int64_t>(
                       std::accumulate(plan.assets.begin(), plan.assets.end(), std::uint64_t{0}, bytes_of)));
        report.print(json_);
        return exit_ok;
    }

private:
    [[noreturn]] void refuse_frames() const {
        throw host::UsageError(fmt::format(
            "obscura batch plan: --frames \"{}\": allowed is A:B with A < B, each 0 to {}, for example 0:46000",
            frames_.substr(0, 60), max_frames));
    }

    void set_frames(const scene::Scene& scene, Plan& plan) const {
        std::uint64_t before = 0, last = options_.trajectory ? scene.camera.motion.samples.size() : 0;
        if (!frames_.empty()) {
            const auto number = [&](std::string_view digits) {
                std::uint64_t value = 0;
                const auto [end, error] =
                    std::from_chars(digits.data(), digits.data() + digits.size(), value);
                if (error != std::errc{} || end != digits.data() + digits.size() || value > max_frames)
                    refuse_frames();
                return value;
            };
            const std::size_t colon = frames_.find(':');
            if (colon != std::string::npos) before = number(std::string_view(frames_).substr(0, colon));
            last = number(std::string_view(frames_).substr(colon == std::string::npos ? 0 : colon + 1));
        } else if (!options_.trajectory) {
            throw host::UsageError(
                "obscura batch plan: --frames is missing (try: obscura batch plan --help)");
        }
        if (before >= last) refuse_frames();
        if (options_.trajectory && last > scene.camera.motion.samples.size())
            throw host::UsageError(
                fmt::format("obscura batch plan: --frames {}: the camera's trajectory has {} samples",
                            frames_, scene.camera.motion.samples.size()));
        plan.frames = {before + 1, last};
        plan.shard_frames = shard_frames_ > 0 ? shard_frames_ : usual_shard_frames(plan.frames.count());
        if (plan.shards() > max_shards)
            throw host::UsageError(
                fmt::format("obscura batch plan: --shard {}: makes {} shards, allowed are at most {}",
                            shard_frames_, plan.shards(), max_shards));
    }

    /// Scene times of at most some 64 frames, evenly spaced.
    [[nodiscard]] std::vector<double> some_times(const scene::Camera& camera,
                                                 const FrameRange& frames) const {
        std::vector<double> out;
        const std::uint64_t step = std::max<std::uint64_t>(1, frames.count() / 64);
        for (std::uint64_t frame = frames.first; frame <= frames.last; frame += step)
            out.push_back(options_.time_of(camera, frame));
        return out;
    }

    void write(const Plan& plan) const {
        const std::filesystem::path file = std::filesystem::path(out_) / plan_name;
        const std::string text = plan_text(plan);
        images::make_writable(out_);
        std::string present;
        if (config::read_text(file, present).empty()) {
            if (present == text) return;
            throw OutputError(fmt::format(
                "{}: there is another plan already; choose another folder, or remove it", file.string()));
        }
        images::write_text(file, text);
    }

    std::string scene_, frames_, out_, format_ = "exr";
    std::uint64_t shard_frames_ = 0;
    RenderOptions options_;
    bool json_ = false;
};

class BatchRun final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "renders shards of a batch, or what is missing of them";
        line.description =
            "Renders the frames of one or more shards that are not done yet: a frame is done if it has a record in the shard's shard.jsonl, and its file has the recorded size and SHA-256. "
            "So a run can be stopped, killed and repeated at any time, on any machine, and two runs of one shard do no harm. "
            "A frame's file appears under its name when it is complete and on the disk. "
            "On SIGTERM and SIGINT the frame in progress is dropped, and the exit status is 75: run it again. "
            "The first error (disk full, scene or asset changed or unreadable) ends the run.";
        declare_batch_folder(line, batch_);
        line.option("--shard", &shards_, "K",
                    "Shards to render, from 0: 7, or 0-9,12. Default: all, one after the other");
        line.number("--threads", &threads_, "N", "Render threads; 0: one per core", 0, 1024);
        line.flag("--quick", quick_,
                  "Take a frame as done if its file has the recorded size, without reading it");
        line.flag("--json", json_, "Print the figures of the run as one JSON object");
        line.examples = {
            "obscura batch run batch                              # all of it, on this machine",
            "obscura batch run batch --shard 17                   # one shard, as a job of a cluster does",
            "obscura batch run batch --quick                      # go on, trusting the sizes of files",
        };
    }

    [[nodiscard]] std::optional<int> interrupted_status() const override { return exit_interrupted; }

    [[nodiscard]] bool keeps_work() const override { return true; }

    int run() override {
        const auto start = std::chrono::steady_clock::now();
        ShardRunner runner(read_plan(batch_), batch_, quick_ ? FrameCheck::size : FrameCheck::hash, threads_);
        const Plan& plan = runner.plan();
        std::vector<std::uint64_t> shards(plan.shards());
        std::iota(shards.begin(), shards.end(), 0);
        if (!shards_.empty()) shards = parse_ranges(shards_, plan.shards(), "obscura batch run: --shard");
        std::uint64_t frames = 0;
        for (const std::uint64_t shard : shards)
            frames += plan.frames_of(shard).count();
        bool complete = true;
        {
            Progress progress("batch run", frames);
            const auto frame_done = [&] {
                progress.done(runner.counts().present + runner.counts().rendered);
            };
            for (std::size_t i = 0; i < shards.size() && complete; ++i)
                complete = runner.run(shards[i], frame_done);
        }
        const auto& [present, rendered] = runner.counts();
        if (!complete)
            print_message(fmt::format("obscura batch run: interrupted, {} of {} frames done",
                                      present + rendered, frames));
        Report report;
        report.add("frames", "frames", static_cast<std::int64_t>(frames));
        report.add("present", "done before", static_cast<std::int64_t>(present));
        report.add("rendered", "rendered", static_cast<std::int64_t>(rendered));
        report.add("seconds", "time",
                   std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), "s", 3);
        report.print(json_);
        return complete ? exit_ok : exit_interrupted;
    }

private:
    std::string batch_, shards_;
    std::uint32_t threads_ = 0;
    bool quick_ = false, json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_batch_plan() {
    return std::make_unique<BatchPlan>();
}
std::unique_ptr<Verb> make_batch_run() {
    return std::make_unique<BatchRun>();
}

} // namespace obscura::tools
