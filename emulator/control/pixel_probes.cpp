// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/pixel_probes.hpp"

#include "core/error.hpp"
#include "emulator/unit/thread_plan.hpp"
#include "service/failure.hpp"

#include <fmt/format.h>

#include <utility>

namespace obscura::emulator {

PixelProbes::PixelProbes(const CoreSet& cores, std::chrono::milliseconds unused_for)
    : thread_([cores] { enter_idle_thread("probe", cores); },
              [this] {
                  probes_.clear();
                  held_ = 0;
              },
              unused_for) {}

PixelProbe& PixelProbes::probe_of(std::size_t camera, const CameraUnit::ProbeSource& source) {
    std::unique_ptr<PixelProbe>& probe = probes_[camera];
    if (!probe || probe->scene() != source.scene.get()) {
        probe.reset(); // never two scenes of a camera
        try {
            probe = std::make_unique<PixelProbe>(source.scene, *source.settings);
        } catch (const Error& error) {
            throw service::Failure(
                service::FailureCode::not_now,
                fmt::format("probe: the scene cannot be loaded any more: {}", error.what()));
        }
        held_ = probes_.size();
    }
    return *probe;
}

template<typename Answer, typename Ask>
Answer PixelProbes::answer_of(std::size_t camera, const CameraUnit::ProbeSource& source,
                              const FrameInfo& info, const std::vector<RowTime>& row_times, Ask ask,
                              const std::atomic<bool>& given_up) {
    // Lives on where the client gives up.
    struct Asked {
        CameraUnit::ProbeSource source;
        FrameInfo info;
        std::vector<RowTime> row_times;
        Answer answer;
    };
    const auto asked = std::make_shared<Asked>(Asked{source, info, row_times, {}});
    thread_.run(
        [this, camera, asked, ask](const std::atomic<bool>& cancel) {
            alone_.execute([&] {
                asked->answer = ask(probe_of(camera, asked->source),
                                    ProbedFrame{asked->info, asked->row_times, asked->source.origin}, cancel);
            });
        },
        given_up);
    return std::move(asked->answer);
}

ProbedPixel PixelProbes::probe(std::size_t camera, const CameraUnit::ProbeSource& source,
                               const FrameInfo& info, const std::vector<RowTime>& row_times, std::int32_t x,
                               std::int32_t y, const std::atomic<bool>& given_up) {
    return answer_of<ProbedPixel>(
        camera, source, info, row_times,
        [x, y](PixelProbe& probe, const ProbedFrame& frame, const std::atomic<bool>& cancel) {
            return probe.probe(frame, x, y, cancel);
        },
        given_up);
}

std::vector<float> PixelProbes::irradiance(std::size_t camera, const CameraUnit::ProbeSource& source,
                                           const FrameInfo& info, const std::vector<RowTime>& row_times,
                                           const std::atomic<bool>& given_up) {
    return answer_of<std::vector<float>>(
        camera, source, info, row_times,
        [](PixelProbe& probe, const ProbedFrame& frame, const std::atomic<bool>& cancel) {
            return probe.irradiance(frame, cancel);
        },
        given_up);
}

} // namespace obscura::emulator
