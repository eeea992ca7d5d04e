// SPDX-License-Identifier: Apache-2.0
#include "tools/scene/scene_frames.hpp"

#include "host/interrupt.hpp"
#include "host/irradiance_image.hpp"
#include "images/writers/exr.hpp"
#include "renderer/camera/lens_cards.hpp"
#include "tools/scene/date_cards.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <utility>

namespace obscura::tools {
namespace {

std::optional<renderer::ScenePoses> poses_of(const scene::Scene& scene) {
    if (!scene.aberration) return std::nullopt;
    return renderer::ScenePoses(scene);
}

std::size_t pixels(const Region& region) {
    return static_cast<std::size_t>(region.area());
}

} // namespace

SceneFrames::SceneFrames(scene::Scene scene, RenderOptions options, std::string_view program)
    : options_(std::move(options)),
      poses_(poses_of(scene)),
      camera_(scene.camera),
      epoch_(scene.epoch),
      bands_(scene.bands),
      region_(options_.region(scene.camera, program)),
      radiance_(scene.quantity == scene::Quantity::radiance),
      renderer_(std::move(scene), options_.settings),
      image_(pixels(region_) * bands_.size()),
      samples_(pixels(region_)),
      variance_(pixels(region_)) {}

const GroundTruth& SceneFrames::begin(std::uint64_t number, double time_s) {
    number_ = number;
    time_s_ = time_s;
    with_aovs_ = false;
    renderer_.fill_truth(Time{std::llround(time_s * 1e9)}, truth_);
    return truth_;
}

bool SceneFrames::render(double budget_s, const std::function<void(std::int32_t rows)>& rows_done) {
    using Clock = std::chrono::steady_clock;
    const auto start = Clock::now();
    // Passes use distinct frame ids, so that no two passes or frames share random numbers.
    constexpr std::uint64_t pass_stride = std::uint64_t{1} << 24;
    passes_ = 0;
    const std::vector<renderer::Renderer::TerrainTiles> before = renderer_.terrain_tiles();
    if (!render_pass(number_, rows_done)) return false;
    note_crowded_tiles(before);
    passes_ = 1;
    if (budget_s <= 0) {
        sum_squares();
        return true;
    }
    std::vector<double> sum(image_.begin(), image_.end());
    // Start a pass only if, at the mean duration of a pass, it ends within the budget.
    while (!host::interrupted() && std::chrono::duration<double>(Clock::now() - start).count() *
                                           (1 + 1.0 / static_cast<double>(passes_)) <
                                       budget_s) {
        if (!render_pass(number_ + passes_ * pass_stride, rows_done)) break;
        std::transform(sum.begin(), sum.end(), image_.begin(), sum.begin(),
                       [](double a, float b) { return a + static_cast<double>(b); });
        ++passes_;
    }
    // Variance of the mean: the sum of the variances over the number of passes squared.
    for (float& v : variance_)
        v /= static_cast<float>(passes_ * passes_);
    std::transform(sum.begin(), sum.end(), image_.begin(),
                   [this](double v) { return static_cast<float>(v / static_cast<double>(passes_)); });
    sum_squares();
    return true;
}

void SceneFrames::note_crowded_tiles(std::span<const renderer::Renderer::TerrainTiles> before) {
    const std::vector<renderer::Renderer::TerrainTiles> after = renderer_.terrain_tiles();
    for (std::size_t k = 0; k < after.size(); ++k) {
        renderer::Renderer::TerrainTiles frame = after[k];
        frame.made -= before[k].made;
        if (frame.made > std::max(frame.slots, crowded_ ? crowded_->made : 0)) crowded_ = frame;
    }
}

bool SceneFrames::render_pass(std::uint64_t frame_id,
                              const std::function<void(std::int32_t rows)>& rows_done) {
    const bool first_pass = passes_ == 0;
    constexpr std::int32_t block_rows = 16;
    const std::size_t plane = pixels(region_);
    const std::size_t planes = bands_.size();
    times_ = renderer::frame_times(camera_, region_, options_.exposure_of(time_s_));
    for (std::int32_t y = 0; y < region_.height; y += block_rows) {
        if (host::interrupted()) return false;
        renderer::RenderRequest request;
        request.window = region_;
        request.first_row = y;
        request.rows = std::min(block_rows, region_.height - y);
        request.row_times = std::span(times_.rows)
                                .subspan(static_cast<std::size_t>(y), static_cast<std::size_t>(request.rows));
        request.common_mid = times_.common_mid;
        request.pixel_times = times_.pixels;
        request.frame_id = frame_id;
        const std::size_t values =
            static_cast<std::size_t>(request.rows) * static_cast<std::size_t>(region_.width);
        band_.resize(values * planes);
        band_samples_.resize(values);
        band_variance_.resize(values);
        request.samples = band_samples_;
        request.variance = band_variance_;
        if (!renderer_.render(request, band_, &host::interrupt_flag())) return false;
        const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(region_.width);
        for (std::size_t i = 0; i < values; ++i) {
            samples_[at + i] = band_samples_[i] + (first_pass ? 0.0F : samples_[at + i]);
            variance_[at + i] = band_variance_[i] + (first_pass ? 0.0F : variance_[at + i]);
        }
        for (std::size_t p = 0; p < planes; ++p)
            std::copy_n(band_.begin() + static_cast<std::ptrdiff_t>(p * values), values,
                        image_.begin() + static_cast<std::ptrdiff_t>(p * plane + at));
        rows_done(y + request.rows);
    }
    return true;
}

bool SceneFrames::trace_aovs() {
    times_ = renderer::frame_times(camera_, region_, options_.exposure_of(time_s_));
    aov_values_.resize(renderer::aov_count * pixels(region_));
    renderer::RenderRequest request;
    request.window = region_;
    request.rows = region_.height;
    request.row_times = times_.rows;
    request.pixel_times = times_.pixels;
    if (camera_.timing != nullptr) {
        times_s_.resize(pixels(region_));
        const auto width = static_cast<std::size_t>(region_.width);
        for (std::int32_t y = 0; y < region_.height; ++y)
            renderer::fill_middles(times_, region_, y,
                                   std::span(times_s_).subspan(static_cast<std::size_t>(y) * width, width));
    }
    with_aovs_ = !host::interrupted() && renderer_.render_aovs(request, aov_values_, &host::interrupt_flag());
    return with_aovs_;
}

/// Sums the frame's estimated variance and the squares of its pixels, mean over the bands, where rays were
/// traced.
void SceneFrames::sum_squares() {
    noise2_ = lit2_ = 0;
    for (std::size_t i = 0; i < variance_.size(); ++i) {
        if (!(variance_[i] > 0)) continue;
        double mean = 0;
        for (std::size_t b = 0; b < bands_.size(); ++b)
            mean +=
                static_cast<double>(image_[b * variance_.size() + i]) / static_cast<double>(bands_.size());
        noise2_ += static_cast<double>(variance_[i]);
        lit2_ += mean * mean;
    }
}

double SceneFrames::noise_rms() const {
    return lit2_ > 0 ? std::sqrt(noise2_ / lit2_) : 0;
}

images::Cards SceneFrames::cards() const {
    images::Cards out{
        {"TIME", time_s_, "[s] scene time"},
        {"EXPTIME", options_.exposure_s, "[s] exposure, half of it before TIME"},
        {"FRAMEID", static_cast<std::int64_t>(number_), "frame of the sequence, from 1"},
        {"SAMPLES", static_cast<std::int64_t>(options_.settings.samples_per_pixel), "rays per pixel"},
        {"SEED", static_cast<std::int64_t>(options_.settings.seed), "of the sampling"},
    };
    if (!options_.window.empty()) {
        out.push_back({"WINDOWX", static_cast<std::int64_t>(region_.x), "[px] first column on the sensor"});
        out.push_back({"WINDOWY", static_cast<std::int64_t>(region_.y), "[px] first row on the sensor"});
    }
    for (const images::Cards& more :
         {date_cards(epoch_, time_s_ - options_.exposure_s / 2, time_s_),
          images::intrinsics_cards(camera_.intrinsics()), renderer::lens_cards(camera_),
          images::scene_cards(truth_), velocity_cards(), host::band_cards(bands_)})
        out.insert(out.end(), more.begin(), more.end());
    return out;
}

/// Velocity of the camera, by which directions are turned; none without aberration.
images::Cards SceneFrames::velocity_cards() const {
    if (!poses_) return {};
    const Vec3 v = poses_->camera_velocity_m_s(time_s_);
    return {{"CAM_VX", v.x, "[m/s] velocity of the camera, for aberration"},
            {"CAM_VY", v.y, "[m/s] velocity of the camera, for aberration"},
            {"CAM_VZ", v.z, "[m/s] velocity of the camera, for aberration"}};
}

std::vector<images::FitsPlane> SceneFrames::layers() const {
    std::vector<images::FitsPlane> out;
    if (!with_aovs_) return out;
    const std::size_t plane = pixels(region_);
    for (std::size_t k = 0; k < renderer::aov_count; ++k) {
        const std::string name = renderer::aov_name(static_cast<renderer::Aov>(k));
        const char* unit = name.ends_with("_m") ? "m" : name.ends_with("_deg") ? "deg" : "";
        out.push_back({name, unit, std::span(aov_values_).subspan(k * plane, plane)});
    }
    if (!times_s_.empty()) out.push_back({"time_s", "s", times_s_});
    out.push_back({"samples", "", samples_});
    out.push_back({"variance", radiance_ ? "W2 m-4 sr-2" : "W2 m-4", variance_});
    return out;
}

void SceneFrames::write(const std::filesystem::path& file, SceneFileFormat format) const {
    const std::string unit = radiance_ ? "W m-2 sr-1" : "W m-2";
    if (format == SceneFileFormat::fits) {
        images::write_fits_float(file, region_.width, region_.height,
                                 static_cast<std::int32_t>(bands_.size()), image_, unit, cards(), layers());
        return;
    }
    std::vector<images::ExrChannel> channels = host::irradiance_channels(image_, bands_);
    if (radiance_)
        for (images::ExrChannel& channel : channels) {
            if (const std::size_t dot = channel.name.find('.'); dot != std::string::npos)
                channel.name.replace(0, dot, "radiance");
            channel.unit = unit;
        }
    for (const images::FitsPlane& layer : layers()) {
        channels.push_back({layer.name, layer.unit, layer.values});
        // The name by which readers of pictures know it.
        if (layer.name == renderer::aov_name(renderer::Aov::depth_m))
            channels.push_back({"Z", layer.unit, layer.values});
    }
    images::write_exr(file, region_.width, region_.height, channels, cards());
}

} // namespace obscura::tools
