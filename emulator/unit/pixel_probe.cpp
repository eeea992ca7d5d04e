// SPDX-License-Identifier: Apache-2.0
#include "emulator/unit/pixel_probe.hpp"

#include "emulator/config/daemon_config.hpp"
#include "emulator/render/shifted_pose.hpp"
#include "emulator/unit/assemble.hpp"
#include "service/failure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

namespace obscura::emulator {
namespace {

using renderer::Aov;

/// Apparent motion by which the scene may differ from that of the frame, at mid-exposure.
constexpr double tolerance_px = 0.05;

/// Whether the inertial pose of a thing is that of its motion.
template<typename Thing>
bool stands_alone(const Thing& thing) {
    return thing.parent.empty() && thing.joint.kind == scene::Joint::Kind::fixed;
}

/// Requests of which a plan has those windows.
std::vector<sensors::WindowRequest> requests_of(const FrameInfo& info) {
    std::vector<sensors::WindowRequest> requests;
    for (std::size_t i = 0; i < info.window_count; ++i) {
        const FrameWindow& w = info.windows[i];
        if (w.read_index == 0) requests.push_back({w.sensor, w.exposure_requested_ns, w.sampling, w.reads});
    }
    return requests;
}

} // namespace

ProbeSettings probe_settings(const DaemonConfig& config) {
    return {render_settings(config, 1), config.sensor, config.daemon.seed};
}

std::optional<std::size_t> window_of(const FrameInfo& frame, std::int32_t x, std::int32_t y) {
    for (std::size_t i = 0; i < frame.window_count; ++i) {
        const FrameWindow& w = frame.windows[i];
        if (y >= w.image_y && y < w.image_y + w.sensor.height)
            return x < w.sensor.width ? std::optional(i) : std::nullopt;
    }
    return std::nullopt;
}

/// What is rendered for a pixel: a block of its row alone, in a window of its column alone.
struct PixelProbe::Place {
    FrameLight light;
    RowBlock block;
    [[nodiscard]] std::size_t pixels() const {
        return static_cast<std::size_t>(block.lines()) * static_cast<std::size_t>(light.width(block));
    }
    /// Index of the pixel among those.
    [[nodiscard]] std::size_t index() const {
        return static_cast<std::size_t>(block.halo_above) * static_cast<std::size_t>(light.width(block)) +
               static_cast<std::size_t>(block.halo_left);
    }
};

struct PixelProbe::Light {
    std::size_t pixels, index; ///< as of Place
    std::vector<float> irradiance, samples;

    explicit Light(const Place& place)
        : pixels(place.pixels()),
          index(place.index()),
          irradiance(place.light.floats(place.block)),
          samples(place.light.push_broom ? 0 : pixels) {}
};

PixelProbe::PixelProbe(std::shared_ptr<const scene::Scene> scene, const ProbeSettings& settings)
    : scene_(std::move(scene)),
      readout_(settings.sensor.readout),
      detector_(std::make_unique<sensors::Detector>(settings.sensor, scene_->bands, scene_->camera.aperture_m,
                                                    settings.seed)),
      lines_(detector_->needs_whole_columns() ? readout_.height
                                              : std::min(1 + 2 * detector_->halo_rows(), readout_.height)),
      blocks_(lines_) {
    scene::Scene own = *scene_;
    attach_shifts(own);
    renderer_ = std::make_unique<renderer::Renderer>(std::move(own), settings.render);
    workspace_ =
        std::make_unique<renderer::Workspace>(*renderer_, 1 + 2 * sensors::Detector::max_halo, lines_);
}

PixelProbe::~PixelProbe() = default;

void PixelProbe::attach_shifts(scene::Scene& scene) {
    const auto attach = [this](scene::Motion& motion) {
        if (!motion.live) return std::shared_ptr<ShiftedPose>();
        live_ = true;
        auto shifted = std::make_shared<ShiftedPose>(motion.live);
        motion.live = shifted;
        return shifted;
    };
    camera_shift_ = stands_alone(scene.camera) ? attach(scene.camera.motion) : nullptr;
    live_ = live_ || scene.camera.motion.live;
    for (scene::Body& body : scene.bodies) {
        body_shifts_.push_back(stands_alone(body) ? attach(body.motion) : nullptr);
        live_ = live_ || body.motion.live;
    }
}

/// Sets the poses of a live scene at mid-exposure to those that the frame was made with.
void PixelProbe::take_poses_of(const ProbedFrame& frame) {
    if (!live_) return;
    const GroundTruth& wanted = frame.info.truth;
    if (camera_shift_) camera_shift_->reset();
    for (const auto& shift : body_shifts_)
        if (shift) shift->reset();
    const Time mid = frame.origin.shown.at(frame.origin.planned(wanted.mid_exposure));
    GroundTruth now;
    // Where bodies are seen depends on where the camera is: more than once.
    constexpr int steps = 3;
    for (int i = 0; i < steps; ++i) {
        renderer_->fill_truth(mid, now);
        if (camera_shift_) camera_shift_->add(now.camera, wanted.camera);
        for (std::size_t b = 0; b < std::min<std::size_t>(wanted.body_count, body_shifts_.size()); ++b)
            if (body_shifts_[b]) body_shifts_[b]->add(now.bodies[b].pose, wanted.bodies[b].pose);
    }
    renderer_->fill_truth(mid, now);
    const double change_px = renderer_->image_change_px(now, wanted);
    // Infinite for more bodies than a frame tells the poses of.
    if (std::isfinite(change_px) && change_px > tolerance_px)
        throw service::Failure(
            service::FailureCode::not_now,
            fmt::format("probe: the poses of frame {} are not known any more", frame.info.frame_id));
}

FrameLight PixelProbe::light_of(const ProbedFrame& frame) const {
    const FrameInfo& info = frame.info;
    FrameLight light;
    light.renderer = renderer_.get();
    light.frame_id = info.frame_id;
    light.push_broom = readout_.shutter == Shutter::push_broom;
    for (std::size_t i = 0; i < info.window_count; ++i)
        light.windows.push_back({info.windows[i].sensor, info.windows[i].image_y});
    for (const RowTime& row : frame.row_times)
        light.rows.push_back({frame.origin.shown.at(frame.origin.planned(row.reset)),
                              frame.origin.shown.at(frame.origin.planned(row.read))});
    light.common_mid = renderer::common_mid(light.rows);
    if (readout_.shutter != Shutter::model) return light;
    if (const std::optional<sensors::ReadoutPlan> plan = plan_of(frame);
        plan && plan->pixel_timing != nullptr)
        for (std::size_t w = 0; w < light.windows.size(); ++w)
            light.pixel_times.push_back(pixel_times_of(
                *plan, w, frame.origin.shown.at(plan->timed_windows[w].trigger), frame.origin.shown.rate));
    return light;
}

PixelProbe::Place PixelProbe::place_of(const ProbedFrame& frame, std::int32_t x, std::int32_t y) const {
    const std::size_t w = *window_of(frame.info, x, y);
    Place place;
    FrameLight& light = place.light;
    light = light_of(frame);

    FrameLight::Window& window = light.windows[w];
    window.sensor.x += x;
    window.sensor.width = 1;
    const std::int32_t halo = detector_->halo_rows();
    RowBlock& block = place.block;
    block.window = w;
    block.first_row = y;
    block.rows = 1;
    if (!light.push_broom) {
        const bool columns = detector_->needs_whole_columns();
        const std::int32_t above = window.sensor.y + y - window.image_y;
        const std::int32_t below = readout_.height - above - 1;
        block.halo_above = columns ? above : std::min(halo, above);
        block.halo_below = columns ? below : std::min(halo, below);
    }
    block.halo_left = std::min(halo, window.sensor.x);
    block.halo_right = std::min(halo, readout_.width - window.sensor.x - 1);
    return place;
}

std::optional<sensors::ReadoutPlan> PixelProbe::plan_of(const ProbedFrame& frame) const {
    sensors::ReadoutPlan plan;
    const Time begin = frame.origin.planned(frame.row_times.front().reset);
    if (!plan_readout(readout_, requests_of(frame.info), begin, plan).empty() ||
        plan.rows.size() != frame.row_times.size())
        return std::nullopt;
    const std::int64_t later_ns = frame.origin.planned(frame.row_times.front().read) - plan.rows.front().read;
    for (Time& release : plan.release)
        release += later_ns;
    for (sensors::TimedWindow& window : plan.timed_windows)
        window.trigger += later_ns;
    std::transform(frame.row_times.begin(), frame.row_times.end(), plan.rows.begin(),
                   [&](const RowTime& row) {
                       return RowTime{frame.origin.planned(row.reset), frame.origin.planned(row.read)};
                   });
    return plan;
}

std::optional<double> PixelProbe::mean_electrons(const ProbedFrame& frame, const Place& place,
                                                 const Light& light) const {
    // Charge spreads between the lines of a row block, whichever those were.
    if (place.light.push_broom && detector_->halo_rows() > 0) return std::nullopt;
    std::optional<sensors::ReadoutPlan> planned = plan_of(frame);
    if (!planned) return std::nullopt;
    sensors::ReadoutPlan& plan = *planned;
    plan.windows.assign(frame.info.windows.begin(), frame.info.windows.begin() + frame.info.window_count);
    plan.windows[place.block.window].sensor = place.light.windows[place.block.window].sensor;
    plan.width = 1;
    const RowBlock& block = place.block;
    const sensors::IrradianceBand band{block.first_row,  block.rows,       place.light.width(block),
                                       light.irradiance, block.halo_above, block.halo_below,
                                       block.halo_left,  block.halo_right};
    std::array<std::uint16_t, 64> unused{};
    float mean_e = 0;
    detector_->begin_run(frame.info.truth.run);
    detector_->expose(plan, band, frame.info.frame_id, {frame.info.gain_db}, unused, {{&mean_e, 1}, {}});
    return static_cast<double>(mean_e);
}

/// Traces the ray through the centre of the pixel.
bool PixelProbe::tell_surface(const Place& place, const std::atomic<bool>& cancel, ProbedPixel& pixel) const {
    const FrameLight& light = place.light;
    const FrameLight::Window& window = light.windows[place.block.window];
    const std::int32_t row = place.block.first_row;
    renderer::RenderRequest request;
    request.window = {window.sensor.x, window.sensor.y + (light.push_broom ? 0 : row - window.image_y), 1, 1};
    request.rows = 1;
    request.row_times = std::span(light.rows).subspan(static_cast<std::size_t>(row), 1);
    if (!light.pixel_times.empty()) request.pixel_times = light.pixel_times[place.block.window];
    request.frame_id = light.frame_id;
    request.alone = workspace_.get();
    std::array<float, renderer::aov_count> aovs{};
    if (!renderer_->render_aovs(request, aovs, &cancel)) return false;
    const auto aov = [&aovs](Aov which) {
        const auto value = static_cast<double>(aovs[static_cast<std::size_t>(which)]);
        return std::isfinite(value) ? std::optional(value) : std::nullopt;
    };
    const auto number = static_cast<std::size_t>(aov(Aov::body).value_or(0));
    if (number == 0) return true;
    const auto& bodies = renderer_->scene().bodies;
    pixel.body = number <= bodies.size() ? bodies[number - 1].name : scene::sun_name;
    pixel.range_m = aov(Aov::range_m);
    pixel.latitude_deg = aov(Aov::latitude_deg);
    pixel.longitude_deg = aov(Aov::longitude_deg);
    pixel.incidence_deg = aov(Aov::incidence_deg);
    pixel.emission_deg = aov(Aov::emission_deg);
    pixel.phase_deg = aov(Aov::phase_deg);
    return true;
}

ProbedPixel PixelProbe::probe(const ProbedFrame& frame, std::int32_t x, std::int32_t y,
                              const std::atomic<bool>& cancel) {
    take_poses_of(frame);
    const Place place = place_of(frame, x, y);
    Light light(place);
    ProbedPixel pixel;
    if (!blocks_.render(place.light, place.block, light.irradiance, &cancel,
                        {workspace_.get(), light.samples}) ||
        !tell_surface(place, cancel, pixel))
        throw service::Failure(service::FailureCode::cancelled, "cancelled");
    pixel.row_mid = frame.row_times[static_cast<std::size_t>(y)].mid();
    if (!place.light.pixel_times.empty()) {
        // By the clock of the rows: the scene may run at another rate.
        const renderer::PixelTimes& pixels = place.light.pixel_times[place.block.window];
        const FrameLight::Window& window = place.light.windows[place.block.window];
        RowTime time;
        pixels.fill(window.sensor.y + y - window.image_y, window.sensor.x, {&time, 1});
        const Time row = place.light.rows[static_cast<std::size_t>(y)].mid();
        pixel.row_mid += std::llround(static_cast<double>(time.mid() - row) / pixels.rate);
    }
    for (std::size_t b = 0; b < renderer_->band_count(); ++b)
        pixel.irradiance_w_m2.push_back(
            static_cast<double>(light.irradiance[b * light.pixels + light.index]));
    if (!light.samples.empty()) pixel.samples = static_cast<double>(light.samples[light.index]);
    pixel.mean_e = mean_electrons(frame, place, light);
    return pixel;
}

std::vector<float> PixelProbe::irradiance(const ProbedFrame& frame, const std::atomic<bool>& cancel) {
    take_poses_of(frame);
    const FrameLight light = light_of(frame);
    const auto width = static_cast<std::size_t>(frame.info.width);
    const std::size_t plane = width * static_cast<std::size_t>(frame.info.height);
    std::vector<float> image(renderer_->band_count() * plane), part;
    constexpr std::int32_t block_rows = 16;
    // Sized for the widest window; a probed pixel needs far less.
    renderer::Workspace workspace(*renderer_, frame.info.width, block_rows);
    BlockRenderer blocks(block_rows);
    for (std::size_t w = 0; w < light.windows.size(); ++w) {
        const FrameLight::Window& window = light.windows[w];
        const auto columns = static_cast<std::size_t>(window.sensor.width);
        for (std::int32_t first = 0; first < window.sensor.height; first += block_rows) {
            RowBlock block;
            block.window = w;
            block.first_row = window.image_y + first;
            block.rows = std::min(block_rows, window.sensor.height - first);
            part.resize(light.floats(block));
            if (!blocks.render(light, block, part, &cancel, {&workspace}))
                throw service::Failure(service::FailureCode::cancelled, "cancelled");
            auto row = part.begin();
            for (std::size_t b = 0; b < renderer_->band_count(); ++b)
                for (std::int32_t r = 0; r < block.rows; ++r, row += static_cast<std::ptrdiff_t>(columns))
                    std::copy_n(row, columns,
                                image.begin() +
                                    static_cast<std::ptrdiff_t>(
                                        b * plane + static_cast<std::size_t>(block.first_row + r) * width));
        }
    }
    return image;
}

} // namespace obscura::emulator
