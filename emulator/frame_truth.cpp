// SPDX-License-Identifier: Apache-2.0
#include "emulator/frame_truth.hpp"

#include "renderer/truth/scene_truth.hpp"
#include "sensors/dark_current.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::emulator {
namespace {

renderer::TruthDetector detector_of(const FrameSource& source, const FrameInfo& info) {
    const DetectorSettings& d = source.sensor.detector;
    renderer::TruthDetector out;
    out.electrons_per_s_per_w_m2 = source.detector.electrons_per_s_per_w_m2();
    out.dark_e_per_s =
        d.dark_current_e_per_s * sensors::dark_current_ratio(d, d.temperature_c, d.dark_reference_c);
    const double dn_per_e = d.gain_dn_per_e * std::pow(10, info.gain_db / 20);
    // Amplifier, reset and the rounding of the ADC; double sampling takes the first two twice.
    const double reset_e = sensors::reset_noise_e(d);
    const double samples = d.double_sampling ? 2 : 1;
    out.noise_e = std::sqrt(samples * (d.read_noise_e * d.read_noise_e + reset_e * reset_e) +
                            1 / (12 * dn_per_e * dn_per_e));
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
    request.frame_id = frame.info.frame_id;
    request.detector = detector_of(source, frame.info);
    request.most_entries = memory.most_entries;
    request.workspace = memory.workspace;
    source.renderer.list_truth(request, truth);
}

} // namespace obscura::emulator
