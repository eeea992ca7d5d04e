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
    if (s.acquisition_frame_count < 1) return "AcquisitionFrameCount 0: allowed 1 and more";
    return {};
}

} // namespace obscura
