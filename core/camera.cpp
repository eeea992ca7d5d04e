#include "core/camera.hpp"

#include <fmt/format.h>

#include <cmath>

namespace obscura {

std::string explain_invalid(const CameraSettings& s, const CameraLimits& limits) {
    const Region& r = s.region;
    const auto check_extent = [](const char* name, std::int32_t value, std::int32_t minimum,
                                 std::int32_t maximum, std::int32_t step) -> std::string {
        if (value < minimum || value > maximum || value % step != 0)
            return fmt::format("{} {}: allowed {} to {} in steps of {}", name, value, minimum, maximum, step);
        return {};
    };
    const std::string extents[] = {
        check_extent("Width", r.width, limits.width_min, limits.sensor_width, limits.width_step),
        check_extent("Height", r.height, limits.height_min, limits.sensor_height, limits.height_step),
        check_extent("OffsetX", r.x, 0, limits.sensor_width - r.width, limits.width_step),
        check_extent("OffsetY", r.y, 0, limits.sensor_height - r.height, limits.height_step),
    };
    for (const std::string& complaint : extents)
        if (!complaint.empty()) return complaint;
    if (s.exposure_ns < limits.exposure_min_ns || s.exposure_ns > limits.exposure_max_ns)
        return fmt::format("ExposureTime {} us: allowed {} to {}", static_cast<double>(s.exposure_ns) / 1e3,
                           static_cast<double>(limits.exposure_min_ns) / 1e3,
                           static_cast<double>(limits.exposure_max_ns) / 1e3);
    if (!(s.gain_db >= limits.gain_min_db && s.gain_db <= limits.gain_max_db))
        return fmt::format("Gain {} dB: allowed {} to {}", s.gain_db, limits.gain_min_db, limits.gain_max_db);
    if (!(s.frame_rate_hz >= limits.frame_rate_min_hz && s.frame_rate_hz <= limits.frame_rate_max_hz))
        return fmt::format("AcquisitionFrameRate {} Hz: allowed {} to {}", s.frame_rate_hz,
                           limits.frame_rate_min_hz, limits.frame_rate_max_hz);
    if (s.trigger_delay_ns < 0 || s.trigger_delay_ns > 10 * ns_per_s)
        return fmt::format("TriggerDelay {} us: allowed 0 to 1e7",
                           static_cast<double>(s.trigger_delay_ns) / 1e3);
    if (s.trigger_divider < 1) return "TriggerDivider 0: allowed 1 and more";
    if (!(s.black_level_dn >= limits.black_level_min_dn && s.black_level_dn <= limits.black_level_max_dn))
        return fmt::format("BlackLevel {} DN: allowed {} to {}", s.black_level_dn, limits.black_level_min_dn,
                           limits.black_level_max_dn);
    if (s.acquisition_frame_count < 1) return "AcquisitionFrameCount 0: allowed 1 and more";
    return {};
}

ReadoutAnswer CameraControl::readout(const CameraSettings& s) const {
    ReadoutAnswer answer;
    answer.window_count = 1;
    FrameWindow& window = answer.windows[0];
    window.sensor = s.region;
    window.exposure_requested_ns = window.exposure_min_ns = window.exposure_max_ns = s.exposure_ns;
    return answer;
}

std::string explain_invalid(const Sequence& sequence, const CameraSettings& settings,
                            const CameraLimits& limits) {
    if (!sequence.enabled) return {};
    if (sequence.start >= Sequence::max_steps)
        return fmt::format("SequencerSetStart {}: allowed 0 to {}", sequence.start, Sequence::max_steps - 1);
    // Only the sets that can be reached count.
    std::array<bool, Sequence::max_steps> seen{};
    for (std::uint32_t step = sequence.start; !seen[step]; step = sequence.steps[step].next) {
        seen[step] = true;
        if (const std::string complaint = explain_invalid(with_step(settings, sequence, step), limits);
            !complaint.empty())
            return fmt::format("sequencer set {}: {}", step, complaint);
        if (const std::uint32_t next = sequence.steps[step].next; next >= Sequence::max_steps)
            return fmt::format("SequencerSetNext {} of set {}: allowed 0 to {}", next, step,
                               Sequence::max_steps - 1);
    }
    return {};
}

CameraSettings with_step(CameraSettings settings, const Sequence& sequence, std::uint32_t step) noexcept {
    const SequenceStep& s = sequence.steps[step % Sequence::max_steps];
    if ((sequence.features & sequenced_exposure) != 0) settings.exposure_ns = s.exposure_ns;
    if ((sequence.features & sequenced_gain) != 0) settings.gain_db = s.gain_db;
    if ((sequence.features & sequenced_black_level) != 0) settings.black_level_dn = s.black_level_dn;
    if ((sequence.features & sequenced_offset_x) != 0) settings.region.x = s.offset_x;
    if ((sequence.features & sequenced_offset_y) != 0) settings.region.y = s.offset_y;
    return settings;
}

} // namespace obscura
