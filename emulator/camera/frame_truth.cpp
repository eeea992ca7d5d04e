// SPDX-License-Identifier: Apache-2.0
#include "emulator/camera/frame_truth.hpp"

#include "renderer/truth/scene_truth.hpp"
#include "sensors/pixel_noise.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::emulator {
namespace {

renderer::TruthDetector detector_of(const FrameSource& source, const FrameInfo& info) {
    const DetectorSettings& d = source.sensor.detector;
    renderer::TruthDetector out;
    out.electrons_per_s_per_w_m2 = source.detector.electrons_per_s_per_w_m2();
    const sensors::PixelNoise noise = sensors::pixel_noise(d, info.gain_db);
    out.dark_e_per_s = noise.dark_e_per_s;
    out.noise_e = noise.readout_e;
    const double dn_per_e = d.gain_dn_per_e * std::pow(10, info.gain_db / 20);
    out.saturation_e = std::min(d.full_well_e, (std::exp2(d.adc_bits) - 1 - d.offset_dn) / dn_per_e);
    return out;
}

} // namespace

void list_truth(const FrameSource& source, const Frame& frame, SceneTruth& truth, const TruthMemory& memory) {
    renderer::TruthRequest request;
    request.windows = source.plan.windows;
    request.rows = source.shown_rows;
    request.row_times = frame.row_times();
    request.push_broom = source.sensor.readout.shutter == Shutter::push_broom;
    request.pixel_times = source.pixel_times;
    request.frame_id = frame.info.frame_id;
    request.detector = detector_of(source, frame.info);
    request.max_entries = memory.max_entries;
    request.workspace = memory.workspace;
    source.renderer.list_truth(request, truth);
}

} // namespace obscura::emulator
