// obscura render: a scene as the camera would see it, in physical units.
#include "config/config.hpp"
#include "renderer/renderer.hpp"
#include "tools/interrupt.hpp"
#include "tools/irradiance_image.hpp"
#include "tools/preview.hpp"
#include "tools/progress.hpp"
#include "tools/report.hpp"
#include "tools/verb.hpp"
#include "transports/file/exr.hpp"
#include "transports/file/fits.hpp"
#include "transports/file/pending_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

namespace obscura::tools {
namespace {

class Render final : public Verb {
public:
    void declare(CommandLine& line) override {
        line.summary = "renders a scene to irradiance per pixel";
        line.description = "Renders the scene file's camera at one instant. EXR and FITS files hold the "
                           "irradiance of every pixel at "
                           "the entrance pupil in W/m2, one channel or plane per spectral band, exactly 0 "
                           "where nothing is. A PNG is "
                           "a stretched 8-bit picture of the first band, to look at. The same scene, "
                           "settings and seed give the same "
                           "bytes on any number of threads.";
        line.positional("SCENE", &scene_, "Scene file (TOML)");
        line.option("-o,--output", &output_, "FILE", "Picture to write: .exr, .fits or .png").required = true;
        line.option("--size", &size_, "WxH",
                    "Pixels, with the same field of view across (default: the scene's)");
        line.number("--samples", &settings_.samples_per_pixel, "N", "Rays per pixel that a body may cover", 1,
                    65536);
        line.number("--error", &settings_.target_error, "SHARE",
                    "Take more samples until a pixel's relative standard error is about this (0: --samples "
                    "everywhere)",
                    0, 1);
        line.number("--max-samples", &settings_.max_samples_per_pixel, "N", "Limit that goes with --error", 1,
                    65536);
        line.number("--threads", &settings_.threads, "N", "Threads; 0: one per core", 0, 1024);
        line.number("--seed", &settings_.seed, "N", "Seed of the sampling", 0, 9e15);
        line.number("--time", &time_s_, "S", "Scene time", -1e9, 1e9);
        line.flag("--json", json_, "Print one JSON object with the figures of the run");
        line.examples = {
            "obscura render config/scenes/demo.toml -o demo.exr",
            "obscura render config/scenes/demo.toml -o demo.png --size 1280x1024 --samples 16",
            "obscura render config/scenes/demo.toml -o later.fits --time 60 --json",
        };
    }

    int run() override {
        const Writer write = writer();
        std::int32_t width = 0, height = 0;
        if (!size_.empty()) parse_size(size_, width, height);
        const std::filesystem::path folder = std::filesystem::path(output_).parent_path();
        transports::require_writable(folder.empty() ? "." : folder);

        scene::Scene scene = config::load_scene(scene_);
        if (!size_.empty()) {
            scene.camera.pixel_pitch_m *= static_cast<double>(scene.camera.width) / width;
            scene.camera.width = width, scene.camera.height = height;
        }
        width = scene.camera.width, height = scene.camera.height;
        const std::size_t plane = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
        const std::vector<scene::SpectralBand> bands = scene.bands;

        const auto start = std::chrono::steady_clock::now();
        const renderer::Renderer renderer(std::move(scene), settings_);
        const auto built = std::chrono::steady_clock::now();
        std::vector<float> image(plane * bands.size());
        if (!fill(renderer, width, height, image)) {
            fmt::print(stderr, "obscura render: interrupted, nothing written\n");
            return exit_failure;
        }
        const auto rendered = std::chrono::steady_clock::now();
        (this->*write)(width, height, bands, image);

        const auto seconds = [](auto span) { return std::chrono::duration<double>(span).count(); };
        double total = 0;
        for (const float value : image)
            total += static_cast<double>(value);
        Report report;
        report.add("output", "written", output_);
        report.add("width", "width", static_cast<std::int64_t>(width));
        report.add("height", "height", static_cast<std::int64_t>(height));
        report.add("bands", "bands", static_cast<std::int64_t>(bands.size()));
        report.add("build_s", "scene made ready in", seconds(built - start), "s", 3);
        report.add("render_s", "rendered in", seconds(rendered - built), "s", 3);
        report.add("rays", "rays", static_cast<std::int64_t>(renderer.rays_traced()));
        report.add("samples", "samples", static_cast<std::int64_t>(renderer.samples_taken()));
        report.add("max_w_m2", "brightest pixel, nW/m2",
                   std::optional(1e9 * static_cast<double>(*std::max_element(image.begin(), image.end()))),
                   "", 6);
        report.add("total_w_m2", "sum of all pixels, nW/m2", std::optional(1e9 * total), "", 6);
        report.print(json_);
        return exit_ok;
    }

private:
    using Writer = void (Render::*)(std::int32_t, std::int32_t, const std::vector<scene::SpectralBand>&,
                                    const std::vector<float>&) const;

    [[nodiscard]] Writer writer() const {
        const std::string extension = std::filesystem::path(output_).extension().string();
        if (extension == ".exr") return &Render::write_exr;
        if (extension == ".fits" || extension == ".fit") return &Render::write_fits;
        if (extension == ".png") return &Render::write_png;
        throw UsageError(
            fmt::format("obscura render: --output {}: the name must end in .exr, .fits or .png", output_));
    }

    bool fill(const renderer::Renderer& renderer, std::int32_t width, std::int32_t height,
              std::vector<float>& image) const {
        constexpr std::int32_t band_rows = 16;
        const std::size_t plane = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
        const std::size_t planes = image.size() / plane;
        const Time when{std::llround(time_s_ * 1e9)};
        const std::vector<RowTime> times(static_cast<std::size_t>(band_rows), {when, when});
        std::vector<float> band;
        Progress progress("render", static_cast<std::uint64_t>(height));
        for (std::int32_t y = 0; y < height; y += band_rows) {
            if (interrupted()) return false;
            renderer::RenderRequest request;
            request.window = {0, 0, width, height};
            request.first_row = y;
            request.rows = std::min(band_rows, height - y);
            request.row_times = std::span(times).first(static_cast<std::size_t>(request.rows));
            request.frame_id = 1;
            const std::size_t values =
                static_cast<std::size_t>(request.rows) * static_cast<std::size_t>(width);
            band.resize(values * planes);
            renderer.render(request, band);
            for (std::size_t p = 0; p < planes; ++p)
                std::copy_n(band.begin() + static_cast<std::ptrdiff_t>(p * values), values,
                            image.begin() + static_cast<std::ptrdiff_t>(p * plane) +
                                static_cast<std::ptrdiff_t>(y) * width);
            progress.done(static_cast<std::uint64_t>(y + request.rows));
        }
        return true;
    }

    [[nodiscard]] transports::Cards cards(const std::vector<scene::SpectralBand>& bands) const {
        transports::Cards out{
            {"TIME", time_s_, "[s] scene time"},
            {"SAMPLES", static_cast<std::int64_t>(settings_.samples_per_pixel), "rays per pixel"},
            {"SEED", static_cast<std::int64_t>(settings_.seed), "of the sampling"},
        };
        const transports::Cards of_bands = band_cards(bands);
        out.insert(out.end(), of_bands.begin(), of_bands.end());
        return out;
    }

    void write_exr(std::int32_t width, std::int32_t height, const std::vector<scene::SpectralBand>& bands,
                   const std::vector<float>& image) const {
        transports::write_exr(output_, width, height, irradiance_channels(image, bands), cards(bands));
    }
    void write_fits(std::int32_t width, std::int32_t height, const std::vector<scene::SpectralBand>& bands,
                    const std::vector<float>& image) const {
        transports::write_fits_float(output_, width, height, static_cast<std::int32_t>(bands.size()), image,
                                     "W m-2", cards(bands));
    }
    void write_png(std::int32_t width, std::int32_t height, const std::vector<scene::SpectralBand>& bands,
                   const std::vector<float>& image) const {
        const auto plane = static_cast<std::ptrdiff_t>(image.size() / bands.size());
        write_preview(output_, width, height, {image.begin(), image.begin() + plane});
    }

    std::string scene_, output_, size_;
    renderer::RenderSettings settings_;
    double time_s_ = 0;
    bool json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_render() {
    return std::make_unique<Render>();
}

} // namespace obscura::tools
