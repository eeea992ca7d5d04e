// SPDX-License-Identifier: Apache-2.0
// Verb `obscura render`: irradiance images of a scene, single or as a sequence.
#include "config/shipped_files.hpp"
#include "core/io/path_state.hpp"
#include "core/text/printable.hpp"
#include "images/writers/pending_file.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "tools/check/plausibility.hpp"
#include "tools/check/report.hpp"
#include "tools/pictures/layer_picture.hpp"
#include "tools/pictures/preview.hpp"
#include "tools/receive/sequence.hpp"
#include "tools/scene/camera_file.hpp"
#include "tools/scene/progress.hpp"
#include "tools/scene/render_options.hpp"
#include "tools/scene/scene_frames.hpp"
#include "tools/scene/truth_option.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <ctime>
#include <filesystem>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace obscura::tools {
namespace {

class Render final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "renders a scene to irradiance per pixel";
        line.description =
            "Renders the camera of a scene file at one instant, or a sequence of frames. "
            "EXR and FITS files hold the irradiance of every pixel at the entrance pupil in W/m2, one channel or plane per spectral band, exactly 0 where no light arrives. "
            "A PNG is an 8-bit picture of the first band with stretched contrast, not for measurement, or with --layer one AOV in false colour with a colour bar. "
            "The same scene, settings and seed give the same bytes on any number of threads (with --time-budget only if the number of passes is the same too). "
            "The file name of a sequence needs a frame number such as %04d; --resume continues an interrupted sequence. "
            "What is odd about the scene (nothing in the field, the camera inside a body, ...) is a warning on standard error, before anything is rendered; "
            "obscura check says more.";
        line.positional("SCENE", &scene_, "Scene file (TOML), or the name of a shipped scene");
        line.option("-o,--output", &output_, "FILE",
                    "Image to write; the name's ending selects the format: .exr, .fits or .png")
            .required = true;
        options_.declare(line, "excludes --frames and replaces --time and --step");
        line.number("--threads", &options_.settings.threads, "N", "Render threads; 0: one per core", 0, 1024);
        line.number("--frames", &frames_, "N", "Number of frames of a sequence", 1, 1e6);
        line.flag("--resume", resume_, "Skip frames whose file exists already");
        line.number(
            "--time-budget", &budget_s_, "S",
            "Render each frame repeatedly for about this many seconds and average the passes (0: one pass)",
            0, 1e6);
        stretch_options_.declare(line, "With PNG: contrast of the picture");
        line.option(
                "--layer", &layer_, "LAYER",
                "With PNG: show this layer in false colour, with a colour bar and its unit or a legend, instead of the irradiance; "
                "\"error\" is the estimated relative standard error")
            .choices = layer_choices();
        line.option(
            "--intrinsics", &intrinsics_file_, "FILE",
            "Also write camera matrix, distortion coefficients and the poses of each frame as JSON that OpenCV's FileStorage reads");
        truth_table_.declare(line);
        line.flag(
            "--strict", strict_,
            "Stop with status 1 before rendering if anything is odd, and after it if the picture is dark");
        line.flag("--json", json_, "Print the figures of the run as one JSON object");
        line.examples = {
            "obscura render config/scenes/demo.toml -o demo.exr",
            "obscura render config/scenes/demo.toml -o demo.png --size 1280x1024 --samples 16",
            "obscura render config/scenes/demo.toml -o depth.png --layer depth",
            "obscura render config/scenes/demo.toml -o later.fits --time 60 --json",
            "obscura render config/scenes/demo.toml -o spin_%03d.png --frames 36 --step 20 --resume",
        };
    }

    int run() override {
        const Format format = format_of_output();
        read_options(format);
        const std::filesystem::path folder = std::filesystem::path(output_).parent_path();
        images::require_writable(folder.empty() ? "." : folder);
        truth_table_.prepare();

        scene::Scene scene = scene::load_scene(config::file_or_shipped(config::shipped_scenes, scene_));
        options_.resize(scene);
        const std::vector<SequenceFrame> sequenced =
            sequence(output_, options_.times_s(scene.camera, frames_));
        for (const scene::Body& body : scene.bodies)
            bodies_.push_back(body.name);

        const auto start = Clock::now();
        SceneFrames frames(std::move(scene), options_, "obscura render");
        std::vector<double> instants(sequenced.size());
        std::transform(sequenced.begin(), sequenced.end(), instants.begin(),
                       [](const SequenceFrame& frame) { return frame.time_s; });
        Plausibility view("", frames.renderer(), instants);
        view.warn("render");
        if (strict_ && !view.oddities().empty()) return exit_failure;
        const auto built = Clock::now();
        const std::clock_t built_cpu = std::clock();
        const Region region = frames.region();
        std::uint64_t written = 0, present = 0;
        Progress progress("render", sequenced.size() * static_cast<std::uint64_t>(region.height));
        std::vector<CameraFileFrame> rendered;
        for (const SequenceFrame& frame : sequenced) {
            const GroundTruth& truth = frames.begin(frame.number, frame.time_s);
            if (!intrinsics_file_.empty())
                rendered.push_back(
                    {frame.file.filename().string(), frame.number, frame.time_s, options_.exposure_s, truth});
            if (truth_table_.given())
                truth_table_.add(frames.renderer(), region, frame.number, options_.exposure_of(frame.time_s));
            if (resume_ && path_exists(frame.file)) {
                ++present;
                continue;
            }
            const std::uint64_t rows_before = (frame.number - 1) * static_cast<std::uint64_t>(region.height);
            const auto rows_done = [&](std::int32_t rows) {
                progress.done(rows_before + static_cast<std::uint64_t>(rows));
            };
            if (!frames.render(budget_s_, rows_done)) break;
            if ((options_.layers || !layer_.empty()) && !frames.trace_aovs()) break;
            write(frames, frame.file, format);
            ++written;
        }
        const double render_s = seconds_since(built);
        const double render_cpu_s = static_cast<double>(std::clock() - built_cpu) / CLOCKS_PER_SEC;
        truth_table_.write();
        if (!intrinsics_file_.empty())
            write_camera_file(intrinsics_file_, PictureCamera::of_scene(frames.camera(), region), rendered);
        if (written + present < sequenced.size())
            print_message(fmt::format("obscura render: interrupted, {} of {} frames written",
                                      written + present, sequenced.size()));

        const double brightest =
            static_cast<double>(*std::max_element(frames.image().begin(), frames.image().end()));
        Report report;
        add_figures(frames,
                    {.build_s = std::chrono::duration<double>(built - start).count(),
                     .render_s = render_s,
                     .render_cpu_s = render_cpu_s,
                     .written = written,
                     .present = present,
                     .brightest_w_m2 = brightest},
                    report);
        // The light of a window, or of the last frame of many, says nothing about the camera.
        if (options_.window.empty() && sequenced.size() == 1 && written == 1) view.judge_light(brightest, 1);
        if (const auto& crowded = frames.crowded_tiles())
            view.judge_tiles(crowded->body, crowded->made, crowded->slots);
        view.add_to(report);
        report.print(json_);
        view.warn("render");
        if (strict_ && !view.oddities().empty()) return exit_failure;
        return written + present == sequenced.size() ? exit_ok : exit_failure;
    }

private:
    using Clock = std::chrono::steady_clock;
    enum class Format : std::uint8_t { exr, fits, png };

    static double seconds_since(Clock::time_point start) {
        return std::chrono::duration<double>(Clock::now() - start).count();
    }

    [[nodiscard]] Format format_of_output() const {
        const std::string extension = std::filesystem::path(output_).extension().string();
        if (extension == ".exr") return Format::exr;
        if (extension == ".fits" || extension == ".fit") return Format::fits;
        if (extension == ".png") return Format::png;
        throw host::UsageError(
            fmt::format("obscura render: --output {}: the name must end in .exr, .fits or .png", output_));
    }

    /// Refuses options that exclude each other.
    void read_options(Format format) {
        if (options_.layers && format == Format::png)
            throw host::UsageError(fmt::format(
                "obscura render: --layers with --output {}: the name must end in .exr or .fits", output_));
        if (!layer_.empty() && format != Format::png)
            throw host::UsageError(fmt::format(
                "obscura render: --layer with --output {}: the name must end in .png (--layers writes all layers to EXR and FITS)",
                output_));
        if (options_.trajectory && frames_ != 1)
            throw host::UsageError("obscura render: --trajectory and --frames exclude each other");
        stretch_ = stretch_options_.parsed("render");
        options_.check();
    }

    /// Times and results of a run.
    struct RunFigures {
        double build_s, render_s, render_cpu_s;
        std::uint64_t written, present;
        double brightest_w_m2; ///< of the last frame
    };

    void add_figures(const SceneFrames& frames, const RunFigures& run, Report& report) const {
        const std::span<const float> image = frames.image();
        const Region region = frames.region();
        const double total = std::accumulate(image.begin(), image.end(), 0.0, [](double sum, float v) {
            return sum + static_cast<double>(v);
        });
        report.add("output", "written", output_);
        report.add("frames", "frames", static_cast<std::int64_t>(run.written));
        if (resume_) report.add("present", "already there", static_cast<std::int64_t>(run.present));
        report.add("width", "width", static_cast<std::int64_t>(region.width));
        report.add("height", "height", static_cast<std::int64_t>(region.height));
        report.add("bands", "bands", static_cast<std::int64_t>(frames.bands().size()));
        if (budget_s_ > 0) report.add("passes", "passes", static_cast<std::int64_t>(frames.passes()));
        report.add("build_s", "scene built in", run.build_s, "s", 3);
        report.add("render_s", "rendered in", run.render_s, "s", 3);
        report.add("render_cpu_s", "CPU time of rendering", run.render_cpu_s, "s", 3);
        report.add("rays", "rays", static_cast<std::int64_t>(frames.renderer().rays_traced()));
        report.add("samples", "samples", static_cast<std::int64_t>(frames.renderer().samples_taken()));
        if (run.written > 0) {
            report.add("max_w_m2", "brightest pixel", fmt::format("{:.6g} W/m2", run.brightest_w_m2),
                       run.brightest_w_m2);
            report.add("total_w_m2", "sum of all pixels", fmt::format("{:.6g} W/m2", total), total);
        }
        if (const double noise = frames.noise_rms(); run.written > 0 && noise > 0)
            report.add("noise_rms", "noise",
                       fmt::format("{:.2g} % rms of the lit pixels (estimated)", 100 * noise), noise);
    }

    void write(const SceneFrames& frames, const std::filesystem::path& file, Format format) const {
        if (format == Format::png)
            write_png(frames, file);
        else
            frames.write(file, format == Format::exr ? SceneFileFormat::exr : SceneFileFormat::fits);
    }

    void write_png(const SceneFrames& frames, const std::filesystem::path& file) const {
        const Region& region = frames.region();
        const std::span<const float> image = frames.image();
        const std::size_t bands = frames.bands().size(), plane = image.size() / bands;
        if (layer_.empty()) {
            const std::span<const float> first = image.first(plane);
            write_preview(file, region.width, region.height, {first.begin(), first.end()}, stretch_);
            return;
        }
        std::vector<float> mean(plane);
        for (std::size_t i = 0; i < image.size(); ++i)
            mean[i % plane] += image[i] / static_cast<float>(bands);
        const std::vector<images::FitsPlane> planes = frames.layers();
        draw_panels({layer_panel(layer_, {region.width, region.height, planes, mean, bodies_})}).write(file);
    }

    std::string scene_, output_, layer_, intrinsics_file_;
    std::vector<std::string> bodies_; ///< names
    RenderOptions options_;
    StretchOptions stretch_options_;
    TruthOption truth_table_;
    host::Stretch stretch_;
    double budget_s_ = 0;
    std::uint64_t frames_ = 1;
    bool resume_ = false, strict_ = false, json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_render() {
    return std::make_unique<Render>();
}

} // namespace obscura::tools
