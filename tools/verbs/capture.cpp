// SPDX-License-Identifier: Apache-2.0
// Verb `obscura capture`: offline rendering and detection of the frames that the daemon would send.
#include "emulator/camera/frame_truth.hpp"
#include "emulator/config/daemon_config.hpp"
#include "emulator/render/frame_light.hpp"
#include "emulator/unit/assemble.hpp"
#include "host/interrupt.hpp"
#include "host/irradiance_image.hpp"
#include "images/writers/exr.hpp"
#include "images/writers/pending_file.hpp"
#include "images/writers/truth_file.hpp"
#include "renderer/camera/lens_cards.hpp"
#include "tools/check/camera_plausibility.hpp"
#include "tools/check/report.hpp"
#include "tools/receive/frame_files.hpp"
#include "tools/scene/camera_file.hpp"
#include "tools/scene/date_cards.hpp"
#include "tools/scene/progress.hpp"
#include "tools/scene/truth_option.hpp"
#include "tools/timing/quality_replay.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <utility>
#include <vector>

namespace obscura::tools {
namespace {

class Capture final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "makes the frames of a camera offline: render and detector, no network";
        line.description =
            "Renders and exposes frames 1 to N of a daemon configuration as fast as the machine can, without triggers or transports, and saves them. "
            "Frame k shows the scene k - 1 trigger periods after its start. "
            "With scene_time = \"nominal\" the frames are byte for byte those that obscurad sends with the same configuration and run word after an acquisition start. "
            "What is odd about the configuration (nothing in the field, much of the frame saturated, readout longer than the trigger period, ...) is a warning on standard error; "
            "obscura check says it beforehand.";
        line.positional("CONFIG", &config_, "Daemon configuration (TOML)");
        line.number("-n,--frames", &frames_, "N", "Number of frames to make", 1, 1e9);
        line.number("--first", &first_, "K", "Number of the first frame to make", 1, 1e9);
        line.number("--run", &run_word_, "N",
                    "Run word of the temporal noise, as the headers of an earlier run state it. "
                    "Default: daemon.run of the configuration",
                    0, 4294967295.0);
        line.option("-o,--output", &output_, "DIR", "Folder for the frames; created when it is missing")
            .required = true;
        files_.declare(line, "Also ");
        line.flag(
            "--truth", truth_,
            "Also save the ground truth of each frame as truth_NNNNNN.fits: electrons before noise, saturated pixels, windows, row times, particle hits");
        truth_table_.declare(line);
        line.flag("--exr", exr_,
                  "Also save the irradiance without detector (W/m2) of each frame as ideal_NNNNNN.exr");
        line.option(
            "--intrinsics", &intrinsics_, "FILE",
            "Also write camera matrix, distortion coefficients and the poses of each frame as JSON that OpenCV's FileStorage reads");
        line.option("--levels", &levels_, "FILE",
                    "Render each frame at the quality levels that it had in a run: "
                    "FILE is what obscurad --timing wrote, of its last acquisition. "
                    "The same bytes, unless poses came from a simulator");
        line.flag(
            "--strict", strict_,
            "Stop with status 1 before the first frame if view or timing are odd, and at the end if the signal is");
        line.flag("--json", json_, "Print the figures of the run as one JSON object");
        line.examples = {
            "obscura capture config/demo.toml --frames 5 -o frames",
            "obscura capture config/demo.toml -n 100 -o frames --format fits --exr",
            "obscura capture config/demo.toml --run 7 -o frames",
            "obscura capture config/realtime.toml -n 20 --levels run.csv -o frames    # a degraded run again",
            "obscura capture config/demo.toml -n 20 -o frames --truth-table frames/truth.csv",
        };
    }

    int run() override {
        files_.prepare("capture");
        emulator::DaemonConfig config = emulator::load_config(config_);
        if (run_word_ != as_configured) config.daemon.run = static_cast<std::int64_t>(run_word_);
        images::make_writable(output_);
        truth_table_.prepare();

        // With pixel truth in any case: it has the expected signal.
        emulator::Imaging imaging(config, 1, {}, {.pixels = true});
        Plausibility view = view_of_camera("", config, imaging);
        view.add_times(times_of_camera(config, imaging));
        view.warn("capture");
        if (strict_ && !view.oddities().empty()) return exit_failure;
        const QualityReplay levels(levels_, imaging.maker->answer(imaging.camera.initial));
        if (levels.needs_earlier()) imaging.maker->keep_frames();
        imaging.catch_up(first_, [&levels](std::uint64_t id) { return levels.of(id); });
        FrameRef frame = imaging.pool->acquire();
        const std::filesystem::path folder(output_);
        const images::Cards lens = renderer::lens_cards(config.scene.camera);
        std::vector<CameraFileFrame> captured;
        std::vector<double> frame_ms;
        std::uint64_t made = 0;
        {
            Progress progress("capture", frames_);
            for (std::uint64_t id = first_; id < first_ + frames_ && !host::interrupted(); ++id) {
                const auto start = std::chrono::steady_clock::now();
                frame = {}; // the pool has one, which it empties
                frame = imaging.pool->acquire();
                const emulator::FrameOrder order = imaging.nominal_order(id);
                imaging.maker->set_levels(levels.of(id));
                if (const std::string refusal = imaging.maker->prepare(order, *frame); !refusal.empty())
                    throw ConfigError(fmt::format("{}: {}", config_, refusal));
                if (!imaging.maker->fill(*frame, nullptr, &host::interrupt_flag())) break;
                frame_ms.push_back(
                    std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
                        .count());
                if (made == 0)
                    if (const auto signal = signal_of_frame(config, *frame)) view.add_signal(*signal);
                const FrameInfo& info = frame->info;
                const double middle_s = to_seconds(info.truth.mid_exposure.ns);
                const images::Cards cards = cards_of(config.scene, *frame, lens);
                files_.save(folder, id, {info.width, info.height, info.bits_per_pixel, frame->pixels()},
                            cards, windows_of(info));
                if (!intrinsics_.empty())
                    captured.push_back(
                        {files_.name(id), id, middle_s, to_seconds(info.exposure_ns), info.truth});
                if (truth_table_.given()) {
                    SceneTruth truth;
                    emulator::list_truth(source_of(imaging, config), *frame, truth);
                    truth_table_.add(std::move(truth), frame->row_times());
                }
                if (truth_) save_truth(imaging, *frame, folder / images::truth_file_name(id), lens);
                if (exr_)
                    save_ideal(imaging, *frame, folder / fmt::format("ideal_{:06}.exr", id),
                               config.scene.bands, lens);
                progress.done(++made);
            }
        }
        truth_table_.write();
        if (!intrinsics_.empty())
            write_camera_file(
                intrinsics_,
                PictureCamera::of_scene(config.scene.camera, picture_of(config.scene.camera, frame->info)),
                captured);
        Report report;
        report.add("frames", "frames", static_cast<std::int64_t>(made));
        report.add("width", "width", static_cast<std::int64_t>(frame->info.width));
        report.add("height", "height", static_cast<std::int64_t>(frame->info.height));
        report.add("run", "run word", static_cast<std::int64_t>(imaging.maker->run()));
        report.add("frame_ms_p50", "render and detector, p50", percentile(frame_ms, 50), "ms", 2);
        report.add("output", "saved in", output_);
        view.add_to(report);
        report.print(json_);
        view.warn("capture");
        if (strict_ && !view.oddities().empty()) return exit_failure;
        return made == frames_ ? exit_ok : exit_failure;
    }

private:
    /// Windows in pixels of the composed image.
    static std::vector<Region> windows_of(const FrameInfo& info) {
        std::vector<Region> out;
        for (std::size_t i = 0; i < info.window_count; ++i) {
            const FrameWindow& w = info.windows[i];
            out.push_back({0, w.image_y, w.sensor.width, w.sensor.height});
        }
        return out;
    }

    /// The part of the sensor that a frame shows; the whole sensor where it is composed of several windows.
    static Region picture_of(const scene::Camera& camera, const FrameInfo& info) {
        if (info.window_count == 1) return info.windows[0].sensor;
        return {0, 0, camera.width, camera.height};
    }

    /// Cards of a frame, with the date of its exposure.
    static images::Cards cards_of(const scene::Scene& scene, const Frame& frame, const images::Cards& lens) {
        images::Cards cards = images::frame_cards(frame);
        const double middle_s = to_seconds(frame.info.truth.mid_exposure.ns);
        const double start_s = middle_s - to_seconds(frame.info.exposure_ns) / 2;
        for (const images::Cards& more : {date_cards(scene.epoch, start_s, middle_s), lens})
            cards.insert(cards.end(), more.begin(), more.end());
        return cards;
    }

    static emulator::FrameSource source_of(const emulator::Imaging& imaging,
                                           const emulator::DaemonConfig& config) {
        const emulator::FrameMaker& maker = *imaging.maker;
        return {*imaging.renderer, *imaging.detector,  config.sensor,
                maker.plan(),      maker.shown_rows(), maker.pixel_times()};
    }

    /// Middle of the exposure of each pixel by the clock of the row times, ns, where pixels have times of
    /// their own; right of narrow windows 0.
    static std::vector<std::int64_t> pixel_middles(const sensors::ReadoutPlan& plan, const Frame& frame) {
        if (plan.pixel_timing == nullptr) return {};
        const std::int64_t later_ns = frame.row_times().front().reset - plan.rows.front().reset;
        const auto width = static_cast<std::size_t>(plan.width);
        std::vector<std::int64_t> middles(width * plan.rows.size());
        for (std::size_t w = 0; w < plan.windows.size(); ++w) {
            const FrameWindow& window = plan.windows[w];
            const renderer::PixelTimes times =
                emulator::pixel_times_of(plan, w, plan.timed_windows[w].trigger + later_ns);
            std::vector<RowTime> row(static_cast<std::size_t>(window.sensor.width));
            for (std::int32_t r = 0; r < window.sensor.height; ++r) {
                times.fill(window.sensor.y + r, window.sensor.x, row);
                std::transform(row.begin(), row.end(),
                               middles.begin() + static_cast<std::ptrdiff_t>(
                                                     static_cast<std::size_t>(window.image_y + r) * width),
                               [](const RowTime& t) { return t.mid().ns; });
            }
        }
        return middles;
    }

    static void save_truth(const emulator::Imaging& imaging, const Frame& frame,
                           const std::filesystem::path& file, const images::Cards& lens) {
        images::write_truth(file, frame, lens, pixel_middles(imaging.maker->plan(), frame));
    }

    static void save_ideal(const emulator::Imaging& imaging, const Frame& frame,
                           const std::filesystem::path& file, const std::vector<SpectralBand>& bands,
                           const images::Cards& lens) {
        const sensors::ReadoutPlan& plan = imaging.maker->plan();
        const auto width = static_cast<std::size_t>(plan.width);
        const std::size_t plane = width * static_cast<std::size_t>(plan.height);
        std::vector<float> image(plane * bands.size());
        std::vector<float> part;
        for (const FrameWindow& window : plan.windows) {
            renderer::RenderRequest request;
            request.window = window.sensor;
            request.rows = window.sensor.height;
            request.row_times = std::span(plan.rows).subspan(static_cast<std::size_t>(window.image_y),
                                                             static_cast<std::size_t>(request.rows));
            request.common_mid = renderer::common_mid(plan.rows);
            request.frame_id = frame.info.frame_id;
            const auto number = static_cast<std::size_t>(&window - plan.windows.data());
            if (plan.pixel_timing != nullptr)
                request.pixel_times =
                    emulator::pixel_times_of(plan, number, plan.timed_windows[number].trigger);
            const auto columns = static_cast<std::size_t>(window.sensor.width);
            part.resize(bands.size() * columns * static_cast<std::size_t>(request.rows));
            imaging.renderer->render(request, part);
            std::size_t line = 0;
            for (std::size_t b = 0; b < bands.size(); ++b)
                for (std::int32_t r = 0; r < request.rows; ++r, ++line)
                    std::copy_n(part.begin() + static_cast<std::ptrdiff_t>(line * columns), columns,
                                image.begin() +
                                    static_cast<std::ptrdiff_t>(
                                        b * plane + static_cast<std::size_t>(window.image_y + r) * width));
        }
        images::Cards cards = images::frame_cards(frame);
        cards.insert(cards.end(), lens.begin(), lens.end());
        images::write_exr(file, plan.width, plan.height, host::irradiance_channels(image, bands), cards);
    }

    std::string config_, output_, intrinsics_, levels_;
    FrameFiles files_;
    TruthOption truth_table_;
    std::uint64_t frames_ = 1, first_ = 1;
    static constexpr std::uint64_t as_configured = std::numeric_limits<std::uint64_t>::max();
    std::uint64_t run_word_ = as_configured;
    bool exr_ = false, truth_ = false, strict_ = false, json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_capture() {
    return std::make_unique<Capture>();
}

} // namespace obscura::tools
