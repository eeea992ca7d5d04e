// SPDX-License-Identifier: Apache-2.0
// Verb `obscura render`: irradiance images of a scene, single or as a sequence.
#include "config/shipped_files.hpp"
#include "images/writers/exr.hpp"
#include "images/writers/fits.hpp"
#include "images/writers/pending_file.hpp"
#include "renderer/camera/lens_cards.hpp"
#include "renderer/renderer.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "renderer/world/scene_poses.hpp"
#include "tools/support/camera_file.hpp"
#include "tools/support/interrupt.hpp"
#include "tools/support/irradiance_image.hpp"
#include "tools/support/layer_picture.hpp"
#include "tools/support/plausibility.hpp"
#include "tools/support/preview.hpp"
#include "tools/support/progress.hpp"
#include "tools/support/report.hpp"
#include "tools/support/sequence.hpp"
#include "tools/support/truth_option.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <ctime>
#include <optional>
#include <string_view>
#include <vector>

namespace obscura::tools {
namespace {

class Render final : public Verb {
public:
    void declare(CommandLine& line) override {
        line.summary = "renders a scene to irradiance per pixel";
        line.description =
            "Renders the camera of a scene file at one instant, or a sequence of frames. EXR and FITS "
            "files hold the irradiance of every pixel at the entrance pupil in W/m2, one channel or plane "
            "per spectral band, exactly 0 where no light arrives. A PNG is an 8-bit picture of the first "
            "band with stretched contrast, not for measurement, or with --layer one AOV in false colour with "
            "a colour bar. The same scene, settings and seed give "
            "the same bytes on any number of threads (with --time-budget only if the number of passes is "
            "the same too). The file name of a sequence needs a frame number such as %04d; --resume "
            "continues an interrupted sequence. What is odd about the scene (nothing in the field, the "
            "camera inside a body, ...) is a warning on standard error, before anything is rendered; obscura "
            "check says more.";
        line.positional("SCENE", &scene_, "Scene file (TOML), or the name of a shipped scene");
        line.option("-o,--output", &output_, "FILE",
                    "Image to write; the name's ending selects the format: .exr, .fits or .png")
            .required = true;
        line.option("--size", &size_, "WxH",
                    "Width and height in pixels, with the same horizontal field of view (default: from the "
                    "scene)");
        line.number("--samples", &settings_.samples_per_pixel, "N",
                    "Samples per pixel, taken where a body may cover the pixel", 1, 65536);
        line.option(
            "--window", &window_text_, "X,Y,WxH",
            "Render only the window of W x H pixels whose upper left corner is (X, Y); its pixels equal "
            "those of the full image");
        line.number(
            "--error", &settings_.target_error, "SHARE",
            "Adaptive sampling: add samples until the relative standard error of a pixel is about this "
            "(0: --samples everywhere); the noise that is reached is printed at the end",
            0, 1);
        line.number("--max-samples", &settings_.max_samples_per_pixel, "N",
                    "With --error: largest number of samples per pixel", 1, 65536);
        line.number(
            "--bounces", &settings_.max_bounces, "N",
            "Maximum path depth: reflections after the first (the scene's own number if that is larger)", 0,
            1000);
        line.number("--threads", &settings_.threads, "N", "Render threads; 0: one per core", 0, 1024);
        line.number("--seed", &settings_.seed, "N", "Seed of the random numbers", 0, 9e15);
        line.number("--time", &time_s_, "S", "Scene time of the first frame in seconds", -1e9, 1e9);
        line.number(
            "--exposure", &exposure_s_, "S",
            "Exposure time in seconds, centred on the frame's scene time; moving bodies and the moving "
            "camera blur",
            0, 1e6);
        line.number("--frames", &frames_, "N", "Number of frames of a sequence", 1, 1e6);
        line.number("--step", &step_s_, "S", "Scene time between consecutive frames in seconds", -1e9, 1e9);
        line.flag("--trajectory", trajectory_,
                  "Render one frame at each time stamp of the camera's trajectory; excludes --frames and "
                  "replaces --time and --step");
        line.flag("--resume", resume_, "Skip frames whose file exists already");
        line.number("--time-budget", &budget_s_, "S",
                    "Render each frame repeatedly for about this many seconds and average the passes (0: one "
                    "pass)",
                    0, 1e6);
        line.flag("--layers", layers_,
                  "With EXR and FITS: also write the AOVs (body, range, depth, normals, latitude, longitude, "
                  "slope, angles, texture coordinates, albedo, material), and the samples and the estimated "
                  "variance of each pixel, as layers or image extensions");
        stretch_options_.declare(line, "With PNG: contrast of the picture");
        line.option("--layer", &layer_, "LAYER",
                    "With PNG: show this layer in false colour, with a colour bar and its unit or a legend, "
                    "instead of the irradiance; \"error\" is the estimated relative standard error")
            .choices = layer_choices();
        line.option(
            "--intrinsics", &intrinsics_file_, "FILE",
            "Also write camera matrix, distortion coefficients and the poses of each frame as JSON that "
            "OpenCV's FileStorage reads");
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
        const Writer write = writer();
        if (layers_ && write == &Render::write_png)
            throw UsageError(fmt::format(
                "obscura render: --layers with --output {}: the name must end in .exr or .fits", output_));
        if (!layer_.empty() && write != &Render::write_png)
            throw UsageError(fmt::format(
                "obscura render: --layer with --output {}: the name must end in .png (--layers writes all "
                "layers to EXR and FITS)",
                output_));
        stretch_ = stretch_options_.parsed("render");
        std::int32_t width = 0, height = 0;
        if (!size_.empty()) parse_size(size_, width, height);
        const std::filesystem::path folder = std::filesystem::path(output_).parent_path();
        images::require_writable(folder.empty() ? "." : folder);
        truth_table_.prepare();

        scene::Scene scene = scene::load_scene(config::file_or_shipped(config::shipped_scenes, scene_));
        if (!size_.empty()) {
            const double larger = static_cast<double>(scene.camera.width) / width;
            scene.camera.pixel_pitch_m *= larger, scene.camera.pixel_pitch_y_m *= larger;
            scene.camera.width = width, scene.camera.height = height;
        }
        width = scene.camera.width, height = scene.camera.height;
        if (!window_text_.empty()) parse_window(width, height);
        const std::vector<SequenceFrame> frames = sequence(output_, times(scene));
        const std::size_t plane = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
        const std::vector<SpectralBand> bands = scene.bands;
        for (const scene::Body& body : scene.bodies)
            bodies_.push_back(body.name);
        camera_ = scene.camera;
        if (scene.aberration) poses_.emplace(scene);
        radiance_ = scene.quantity == scene::Quantity::radiance;

        const auto start = Clock::now();
        const renderer::Renderer renderer(std::move(scene), settings_);
        std::vector<double> instants(frames.size());
        std::transform(frames.begin(), frames.end(), instants.begin(),
                       [](const SequenceFrame& frame) { return frame.time_s; });
        Plausibility view("", renderer, instants);
        view.warn("render");
        if (strict_ && !view.oddities().empty()) return exit_failure;
        const auto built = Clock::now();
        const std::clock_t built_cpu = std::clock();
        std::vector<float> image(plane * bands.size());
        std::uint64_t written = 0, present = 0;
        Progress progress("render", frames.size() * static_cast<std::uint64_t>(height));
        std::vector<CameraFileFrame> rendered;
        for (const SequenceFrame& frame : frames) {
            renderer.fill_truth(Time{std::llround(frame.time_s * 1e9)}, truth_);
            if (!intrinsics_file_.empty())
                rendered.push_back(
                    {frame.file.filename().string(), frame.number, frame.time_s, exposure_s_, truth_});
            if (truth_table_.given())
                truth_table_.add(renderer, {window_x_, window_y_, width, height}, frame.number,
                                 exposure_of(frame.time_s));
            if (resume_ && std::filesystem::exists(frame.file)) {
                ++present;
                continue;
            }
            if (!average(renderer, width, height, frame, progress, image)) break;
            if (with_layers() && !trace_aovs(renderer, width, height, frame)) break;
            (this->*write)(frame, width, height, bands, image);
            ++written;
        }
        const double render_s = seconds_since(built);
        const double render_cpu_s = static_cast<double>(std::clock() - built_cpu) / CLOCKS_PER_SEC;
        truth_table_.write();
        if (!intrinsics_file_.empty())
            write_camera_file(intrinsics_file_,
                              PictureCamera::of_scene(camera_, {window_x_, window_y_, width, height}),
                              rendered);
        if (written + present < frames.size())
            fmt::print(stderr, "obscura render: interrupted, {} of {} frames written\n", written + present,
                       frames.size());

        double total = 0;
        for (const float value : image)
            total += static_cast<double>(value);
        const double brightest = static_cast<double>(*std::max_element(image.begin(), image.end()));
        Report report;
        report.add("output", "written", output_);
        report.add("frames", "frames", static_cast<std::int64_t>(written));
        if (resume_) report.add("present", "already there", static_cast<std::int64_t>(present));
        report.add("width", "width", static_cast<std::int64_t>(width));
        report.add("height", "height", static_cast<std::int64_t>(height));
        report.add("bands", "bands", static_cast<std::int64_t>(bands.size()));
        if (budget_s_ > 0) report.add("passes", "passes", static_cast<std::int64_t>(passes_));
        report.add("build_s", "scene built in", std::chrono::duration<double>(built - start).count(), "s", 3);
        report.add("render_s", "rendered in", render_s, "s", 3);
        report.add("render_cpu_s", "CPU time of rendering", render_cpu_s, "s", 3);
        report.add("rays", "rays", static_cast<std::int64_t>(renderer.rays_traced()));
        report.add("samples", "samples", static_cast<std::int64_t>(renderer.samples_taken()));
        if (written > 0) {
            report.add("max_w_m2", "brightest pixel", fmt::format("{:.6g} W/m2", brightest), brightest);
            report.add("total_w_m2", "sum of all pixels", fmt::format("{:.6g} W/m2", total), total);
        }
        if (const double noise = noise_rms(); written > 0 && noise > 0)
            report.add("noise_rms", "noise",
                       fmt::format("{:.2g} % rms of the lit pixels (estimated)", 100 * noise), noise);
        // The light of a window, or of the last frame of many, says nothing about the camera.
        if (window_text_.empty() && frames.size() == 1 && written == 1) view.judge_light(brightest, 1);
        view.add_to(report);
        report.print(json_);
        view.warn("render");
        if (strict_ && !view.oddities().empty()) return exit_failure;
        return written + present == frames.size() ? exit_ok : exit_failure;
    }

private:
    using Clock = std::chrono::steady_clock;
    using Writer = void (Render::*)(const SequenceFrame&, std::int32_t, std::int32_t,
                                    const std::vector<SpectralBand>&, const std::vector<float>&) const;

    static double seconds_since(Clock::time_point start) {
        return std::chrono::duration<double>(Clock::now() - start).count();
    }

    /// Parses --window and replaces `width` and `height` of the sensor by those of the window.
    void parse_window(std::int32_t& width, std::int32_t& height) {
        const std::size_t comma = window_text_.rfind(',');
        const auto number = [](std::string_view digits, std::int32_t& value) {
            const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
            return error == std::errc{} && end == digits.data() + digits.size() && value >= 0;
        };
        const std::string corner = comma == std::string::npos ? "" : window_text_.substr(0, comma);
        const std::size_t middle = corner.find(',');
        std::int32_t w = 0, h = 0;
        bool good = middle != std::string::npos && number(corner.substr(0, middle), window_x_) &&
                    number(corner.substr(middle + 1), window_y_);
        if (good) parse_size(std::string_view(window_text_).substr(comma + 1), w, h);
        good = good && window_x_ < width && window_y_ < height && w <= width - window_x_ &&
               h <= height - window_y_;
        if (!good)
            throw UsageError(
                fmt::format("obscura render: --window \"{}\": allowed is X,Y,WIDTHxHEIGHT inside the "
                            "{} x {} pixels, for example 8,16,64x32",
                            window_text_.substr(0, 60), width, height));
        width = w, height = h;
    }

    /// Exposure of all rows of a frame.
    [[nodiscard]] RowTime exposure_of(double time_s) const {
        const Time when{std::llround(time_s * 1e9)};
        const std::int64_t half_ns = std::llround(exposure_s_ * 0.5e9);
        return {when - half_ns, when + half_ns};
    }

    [[nodiscard]] std::vector<double> times(const scene::Scene& scene) const {
        std::vector<double> out;
        if (trajectory_) {
            if (frames_ != 1)
                throw UsageError("obscura render: --trajectory and --frames exclude each other");
            for (const scene::TimedPose& sample : scene.camera.motion.samples)
                out.push_back(sample.time_s);
            return out;
        }
        for (std::uint64_t i = 0; i < frames_; ++i)
            out.push_back(time_s_ + static_cast<double>(i) * step_s_);
        return out;
    }

    /// Averages passes of one frame until the time budget is spent. Returns false when interrupted.
    bool average(const renderer::Renderer& renderer, std::int32_t width, std::int32_t height,
                 const SequenceFrame& frame, Progress& progress, std::vector<float>& image) {
        const auto start = Clock::now();
        // Passes use distinct frame ids, so that no two passes or frames share random numbers.
        constexpr std::uint64_t pass_stride = std::uint64_t{1} << 24;
        passes_ = 0;
        samples_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
        variance_.resize(samples_.size());
        std::uint64_t rows_before = (frame.number - 1) * static_cast<std::uint64_t>(height);
        if (!fill(renderer, width, height, frame.number, frame.time_s, rows_before, progress, image))
            return false;
        passes_ = 1;
        if (budget_s_ <= 0) {
            sum_squares(image);
            return true;
        }
        std::vector<double> sum(image.begin(), image.end());
        // Start a pass only if, at the mean duration of a pass, it ends within the budget.
        while (!interrupted() &&
               seconds_since(start) * (1 + 1.0 / static_cast<double>(passes_)) < budget_s_) {
            if (!fill(renderer, width, height, frame.number + passes_ * pass_stride, frame.time_s,
                      rows_before, progress, image))
                break;
            std::transform(sum.begin(), sum.end(), image.begin(), sum.begin(),
                           [](double a, float b) { return a + static_cast<double>(b); });
            ++passes_;
        }
        // Variance of the mean: the sum of the variances over the number of passes squared.
        for (float& v : variance_)
            v /= static_cast<float>(passes_ * passes_);
        std::transform(sum.begin(), sum.end(), image.begin(),
                       [this](double v) { return static_cast<float>(v / static_cast<double>(passes_)); });
        sum_squares(image);
        return true;
    }

    /// Sums the frame's estimated variance and the squares of its pixels, mean over the bands, where rays
    /// were traced.
    void sum_squares(const std::vector<float>& image) {
        const std::size_t bands = image.size() / variance_.size();
        noise2_ = lit2_ = 0;
        for (std::size_t i = 0; i < variance_.size(); ++i) {
            if (!(variance_[i] > 0)) continue;
            double mean = 0;
            for (std::size_t b = 0; b < bands; ++b)
                mean += static_cast<double>(image[b * variance_.size() + i]) / static_cast<double>(bands);
            noise2_ += static_cast<double>(variance_[i]);
            lit2_ += mean * mean;
        }
    }

    /// Estimated noise of the last frame, rms over the rms of the lit pixels; 0: no body was sampled.
    [[nodiscard]] double noise_rms() const { return lit2_ > 0 ? std::sqrt(noise2_ / lit2_) : 0; }

    [[nodiscard]] Writer writer() const {
        const std::string extension = std::filesystem::path(output_).extension().string();
        if (extension == ".exr") return &Render::write_exr;
        if (extension == ".fits" || extension == ".fit") return &Render::write_fits;
        if (extension == ".png") return &Render::write_png;
        throw UsageError(
            fmt::format("obscura render: --output {}: the name must end in .exr, .fits or .png", output_));
    }

    bool fill(const renderer::Renderer& renderer, std::int32_t width, std::int32_t height,
              std::uint64_t frame_id, double time_s, std::uint64_t rows_before, Progress& progress,
              std::vector<float>& image) {
        const bool first_pass = passes_ == 0;
        constexpr std::int32_t band_rows = 16;
        const std::size_t plane = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
        const std::size_t planes = image.size() / plane;
        const std::vector<RowTime> times(static_cast<std::size_t>(band_rows), exposure_of(time_s));
        std::vector<float> band;
        for (std::int32_t y = 0; y < height; y += band_rows) {
            if (interrupted()) return false;
            renderer::RenderRequest request;
            request.window = {window_x_, window_y_, width, height};
            request.first_row = y;
            request.rows = std::min(band_rows, height - y);
            request.row_times = std::span(times).first(static_cast<std::size_t>(request.rows));
            request.common_mid = times.front().mid();
            request.frame_id = frame_id;
            const std::size_t values =
                static_cast<std::size_t>(request.rows) * static_cast<std::size_t>(width);
            band.resize(values * planes);
            band_samples_.resize(values);
            band_variance_.resize(values);
            request.samples = band_samples_;
            request.variance = band_variance_;
            renderer.render(request, band);
            const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
            for (std::size_t i = 0; i < values; ++i) {
                samples_[at + i] = band_samples_[i] + (first_pass ? 0.0F : samples_[at + i]);
                variance_[at + i] = band_variance_[i] + (first_pass ? 0.0F : variance_[at + i]);
            }
            for (std::size_t p = 0; p < planes; ++p)
                std::copy_n(band.begin() + static_cast<std::ptrdiff_t>(p * values), values,
                            image.begin() + static_cast<std::ptrdiff_t>(p * plane) +
                                static_cast<std::ptrdiff_t>(y) * width);
            progress.done(rows_before + static_cast<std::uint64_t>(y + request.rows));
        }
        return true;
    }

    /// Renders the AOVs of every pixel at the frame's scene time into aov_values_. Returns false when
    /// interrupted.
    bool trace_aovs(const renderer::Renderer& renderer, std::int32_t width, std::int32_t height,
                    const SequenceFrame& frame) {
        const Time when{std::llround(frame.time_s * 1e9)};
        const std::vector<RowTime> times(static_cast<std::size_t>(height), {when, when});
        aov_values_.resize(renderer::aov_count * static_cast<std::size_t>(width) *
                           static_cast<std::size_t>(height));
        renderer::RenderRequest request;
        request.window = {window_x_, window_y_, width, height};
        request.rows = height;
        request.row_times = times;
        return !interrupted() && renderer.render_aovs(request, aov_values_);
    }

    [[nodiscard]] images::Cards cards(const SequenceFrame& frame,
                                      const std::vector<SpectralBand>& bands) const {
        images::Cards out{
            {"TIME", frame.time_s, "[s] scene time"},
            {"EXPTIME", exposure_s_, "[s] exposure, half of it before TIME"},
            {"FRAMEID", static_cast<std::int64_t>(frame.number), "frame of the sequence, from 1"},
            {"SAMPLES", static_cast<std::int64_t>(settings_.samples_per_pixel), "rays per pixel"},
            {"SEED", static_cast<std::int64_t>(settings_.seed), "of the sampling"},
        };
        if (!window_text_.empty()) {
            out.push_back(
                {"WINDOWX", static_cast<std::int64_t>(window_x_), "[px] first column on the sensor"});
            out.push_back({"WINDOWY", static_cast<std::int64_t>(window_y_), "[px] first row on the sensor"});
        }
        for (const images::Cards& more :
             {images::intrinsics_cards(camera_.intrinsics()), renderer::lens_cards(camera_),
              images::scene_cards(truth_), velocity_cards(frame.time_s)})
            out.insert(out.end(), more.begin(), more.end());
        const images::Cards of_bands = band_cards(bands);
        out.insert(out.end(), of_bands.begin(), of_bands.end());
        return out;
    }

    /// Velocity of the camera, by which directions are turned; none without aberration.
    [[nodiscard]] images::Cards velocity_cards(double time_s) const {
        if (!poses_) return {};
        const Vec3 v = poses_->camera_velocity_m_s(time_s);
        return {{"CAM_VX", v.x, "[m/s] velocity of the camera, for aberration"},
                {"CAM_VY", v.y, "[m/s] velocity of the camera, for aberration"},
                {"CAM_VZ", v.z, "[m/s] velocity of the camera, for aberration"}};
    }

    [[nodiscard]] bool with_layers() const { return layers_ || !layer_.empty(); }

    /// AOVs, samples and variance with their units; empty without --layers and --layer.
    [[nodiscard]] std::vector<images::FitsPlane> layers(std::int32_t width, std::int32_t height) const {
        std::vector<images::FitsPlane> out;
        if (!with_layers()) return out;
        const std::size_t plane = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
        for (std::size_t k = 0; k < renderer::aov_count; ++k) {
            const std::string name = renderer::aov_name(static_cast<renderer::Aov>(k));
            const char* unit = name.ends_with("_m") ? "m" : name.ends_with("_deg") ? "deg" : "";
            out.push_back({name, unit, std::span(aov_values_).subspan(k * plane, plane)});
        }
        out.push_back({"samples", "", samples_});
        out.push_back({"variance", radiance_ ? "W2 m-4 sr-2" : "W2 m-4", variance_});
        return out;
    }

    void write_exr(const SequenceFrame& frame, std::int32_t width, std::int32_t height,
                   const std::vector<SpectralBand>& bands, const std::vector<float>& image) const {
        std::vector<images::ExrChannel> channels = irradiance_channels(image, bands);
        if (radiance_)
            for (images::ExrChannel& channel : channels) {
                channel.name.replace(0, channel.name.find('.'), "radiance");
                channel.unit = "W m-2 sr-1";
            }
        for (const images::FitsPlane& layer : layers(width, height))
            channels.push_back({layer.name, layer.unit, layer.values});
        images::write_exr(frame.file, width, height, channels, cards(frame, bands));
    }
    void write_fits(const SequenceFrame& frame, std::int32_t width, std::int32_t height,
                    const std::vector<SpectralBand>& bands, const std::vector<float>& image) const {
        images::write_fits_float(frame.file, width, height, static_cast<std::int32_t>(bands.size()), image,
                                 radiance_ ? "W m-2 sr-1" : "W m-2", cards(frame, bands),
                                 layers(width, height));
    }
    void write_png(const SequenceFrame& frame, std::int32_t width, std::int32_t height,
                   const std::vector<SpectralBand>& bands, const std::vector<float>& image) const {
        const auto plane = static_cast<std::ptrdiff_t>(image.size() / bands.size());
        if (layer_.empty()) {
            write_preview(frame.file, width, height, {image.begin(), image.begin() + plane}, stretch_);
            return;
        }
        std::vector<float> mean(static_cast<std::size_t>(plane));
        for (std::size_t i = 0; i < image.size(); ++i)
            mean[i % mean.size()] += image[i] / static_cast<float>(bands.size());
        const std::vector<images::FitsPlane> planes = layers(width, height);
        draw_panels({layer_panel(layer_, {width, height, planes, mean, bodies_})}).write(frame.file);
    }

    std::string scene_, output_, size_, window_text_, layer_, intrinsics_file_;
    std::vector<std::string> bodies_; ///< names
    StretchOptions stretch_options_;
    TruthOption truth_table_;
    Stretch stretch_;
    std::int32_t window_x_ = 0, window_y_ = 0;
    renderer::RenderSettings settings_;
    scene::Camera camera_;
    std::optional<renderer::ScenePoses> poses_; ///< with aberration, for the camera's velocity
    GroundTruth truth_;                         ///< of the frame that is being made
    double exposure_s_ = 0;
    double time_s_ = 0, step_s_ = 1, budget_s_ = 0;
    std::uint64_t frames_ = 1, passes_ = 0;
    bool trajectory_ = false, resume_ = false;
    double noise2_ = 0, lit2_ = 0; ///< see sum_squares()
    std::vector<float> aov_values_, samples_, variance_, band_samples_, band_variance_;
    bool layers_ = false, radiance_ = false, strict_ = false, json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_render() {
    return std::make_unique<Render>();
}

} // namespace obscura::tools
