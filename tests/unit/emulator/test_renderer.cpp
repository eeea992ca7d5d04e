// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/emulator/test_renderer.hpp"

#include "renderer/renderer.hpp"

#include <algorithm>
#include <cmath>
#include <thread>
#include <utility>

namespace obscura::test {

RenderGate& render_gate() {
    static RenderGate gate;
    return gate;
}

float test_irradiance(std::int32_t x, std::int32_t y, std::int64_t mid_ns, std::uint64_t frame_id) {
    const auto phase = static_cast<std::uint64_t>(x * 7 + y * 13) +
                       static_cast<std::uint64_t>(mid_ns / 1000) + frame_id * 101;
    return static_cast<float>(phase % 997) * 1e-10F;
}

} // namespace obscura::test

namespace obscura::renderer {

struct FrameSamples::Impl {};
FrameSamples::FrameSamples() = default;
FrameSamples::~FrameSamples() = default;
void FrameSamples::begin_frame() noexcept {}

struct ReprojectionSource::Impl {
    std::vector<KeptWindow> windows;
};
ReprojectionSource::ReprojectionSource(const Renderer& /*renderer*/, std::int32_t /*width*/,
                                       std::int32_t /*rows*/, std::size_t windows)
    : impl_(std::make_unique<Impl>()) {
    impl_->windows.reserve(windows);
}
ReprojectionSource::~ReprojectionSource() = default;
bool ReprojectionSource::begin_frame(std::span<const KeptWindow> windows) noexcept {
    impl_->windows.assign(windows.begin(), windows.end());
    return true;
}
void ReprojectionSource::begin_reprojection() noexcept {}
bool ReprojectionSource::complete(const Renderer& /*renderer*/) const noexcept {
    return test::frames_are_kept.load() && !impl_->windows.empty();
}
std::span<const KeptWindow> ReprojectionSource::windows() const noexcept {
    return impl_->windows;
}

struct Workspace::Impl {};
Workspace::Workspace(const Renderer& /*renderer*/, std::int32_t /*width*/, std::int32_t /*rows*/) {}
Workspace::~Workspace() = default;

struct Renderer::Impl {
    scene::Scene scene;
};

Renderer::Renderer(scene::Scene scene, RenderSettings /*settings*/)
    : impl_(std::make_unique<Impl>(Impl{std::move(scene)})) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

const scene::Scene& Renderer::scene() const noexcept {
    return impl_->scene;
}
std::size_t Renderer::band_count() const noexcept {
    return 1;
}

bool Renderer::render(const RenderRequest& request, std::span<float> irradiance,
                      const std::atomic<bool>* cancel) const {
    test::RenderGate& gate = test::render_gate();
    ++gate.waiting;
    gate.waiting.notify_all();
    while (gate.closed.load() && request.alone == nullptr && !(cancel != nullptr && cancel->load()))
        std::this_thread::yield();
    --gate.waiting;
    if (cancel != nullptr && cancel->load()) return false;
    ++gate.bands;
    bool complete = true;
    for (std::int32_t r = 0; r < request.rows; ++r) {
        if (request.gate != nullptr && !request.gate->wants(r)) {
            complete = false;
            continue;
        }
        const QualityLevel level =
            request.levels.empty() ? QualityLevel::full : request.levels[static_cast<std::size_t>(r)];
        if (gate.row_work) gate.row_work(level);
        const std::size_t row = static_cast<std::size_t>(r) * static_cast<std::size_t>(request.window.width);
        for (const auto& [plane, value] : {std::pair(request.samples, 1.0F), {request.variance, 1e-20F}})
            if (!plane.empty())
                std::fill_n(plane.begin() + static_cast<std::ptrdiff_t>(row), request.window.width, value);
        for (std::int32_t x = 0; x < request.window.width; ++x)
            irradiance[static_cast<std::size_t>(r * request.window.width + x)] = test::test_irradiance(
                request.window.x + x, request.window.y + request.first_row + (request.line ? 0 : r),
                request.row_times[static_cast<std::size_t>(r)].mid().ns,
                request.frame_id + 1000 * static_cast<std::uint64_t>(level));
        if (request.gate != nullptr) request.gate->done(r, {1, level});
    }
    return complete;
}

bool Renderer::kept_motion_px(const RenderRequest& /*request*/, std::span<float> px,
                              const std::atomic<bool>* /*cancel*/) const {
    std::fill(px.begin(), px.end(), 0.0F);
    return true;
}

bool Renderer::has_level(QualityLevel level) const noexcept {
    return level != QualityLevel::bounces;
}
std::uint32_t Renderer::bounces_at(QualityLevel /*level*/) const noexcept {
    return 0;
}

double Renderer::image_motion_px(const RowTime& span) const noexcept {
    return test::motion_px_per_s * static_cast<double>(span.read - span.reset) * 1e-9;
}

double Renderer::image_change_px(const GroundTruth& from, const GroundTruth& to) const noexcept {
    return std::abs(to.camera.position_m.y - from.camera.position_m.y);
}

double Renderer::lamp_change_px(const GroundTruth& /*from*/, std::span<const Pose> from_lamps,
                                const GroundTruth& /*to*/, std::span<const Pose> to_lamps) const noexcept {
    return length(to_lamps.front().position_m - from_lamps.front().position_m);
}
void Renderer::fill_lamps(Time /*t*/, std::span<Pose> lamps) const noexcept {
    lamps.front().position_m = {test::lamp_px.load(), 0, 0};
}
void Renderer::fill_truth(Time t, GroundTruth& truth) const noexcept {
    truth.mid_exposure = t;
    truth.camera.position_m = {to_seconds(t.ns), test::live_px.load(), 0};
    truth.camera_pose_age_s = test::pose_age_s.load();
}
void Renderer::list_truth(const TruthRequest& /*request*/, SceneTruth& /*truth*/) const {}
std::uint64_t Renderer::rays_traced() const noexcept {
    return 0;
}
RenderWork Renderer::work() const noexcept {
    return {};
}
std::uint64_t Renderer::samples_taken() const noexcept {
    return 0;
}

} // namespace obscura::renderer
