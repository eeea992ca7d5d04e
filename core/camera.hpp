// What a client can set on the emulated camera, and the seam through which a transport does so.
#pragma once

#include "core/frame.hpp"
#include "core/region.hpp"
#include "core/time.hpp"

#include <cstdint>
#include <string>

namespace obscura {

/// SFNC AcquisitionMode.
enum class AcquisitionMode : std::uint8_t { continuous, single_frame, multi_frame };

/// SFNC TriggerSource, as far as this camera has them. `line0` is the bench's clock: whatever source the
/// configuration wires to it (timer, GPIO edge, PPS, simulator).
enum class TriggerSource : std::uint8_t { software, line0, action1 };

/// The settings a client may change while the camera runs. Plain data; a change applies from the next frame
/// on.
struct CameraSettings {
    Region region; ///< SFNC Width, Height, OffsetX, OffsetY, in sensor pixels
    PixelFormat pixel_format = PixelFormat::mono16;
    std::int64_t exposure_ns = 10 * ns_per_ms; ///< SFNC ExposureTime (there in us)
    double gain_db = 0;                        ///< SFNC Gain
    AcquisitionMode acquisition_mode = AcquisitionMode::continuous;
    std::uint32_t acquisition_frame_count = 1; ///< MultiFrame only
    bool trigger_enabled = true;               ///< SFNC TriggerMode; off: free run at frame_rate_hz
    TriggerSource trigger_source = TriggerSource::line0;
    std::int64_t trigger_delay_ns = 0;
    double frame_rate_hz = 10; ///< SFNC AcquisitionFrameRate: free run

    constexpr bool operator==(const CameraSettings&) const = default;
};

/// The limits within which CameraSettings must stay; constant for the life of the camera.
struct CameraLimits {
    std::int32_t sensor_width = 0, sensor_height = 0;
    std::int32_t width_step = 1, height_step = 1; ///< increments of Width, Height and the offsets
    std::int32_t width_min = 1, height_min = 1;
    int adc_bits = 12;
    std::int64_t exposure_min_ns = 1000, exposure_max_ns = 10 * ns_per_s;
    double gain_min_db = 0, gain_max_db = 24;
    double frame_rate_min_hz = 0.01, frame_rate_max_hz = 1000;
};

/// Why `settings` cannot be had within `limits`: the SFNC feature and what is allowed; empty when they can.
[[nodiscard]] std::string explain_invalid(const CameraSettings& settings, const CameraLimits& limits);

/// The camera as its control port sees it. Implemented by the emulator; called on a transport's control
/// thread (one at a time). None of the calls blocks for longer than it takes to finish the band of rows in
/// work.
class CameraControl {
public:
    virtual ~CameraControl() = default;

    [[nodiscard]] virtual CameraLimits limits() const = 0;
    [[nodiscard]] virtual CameraSettings settings() const = 0;
    /// Applies all of `settings` from the next frame on, or nothing: false when they are outside the limits.
    virtual bool apply(const CameraSettings& settings) = 0;

    /// Frame ids restart at 1. False when already running.
    virtual bool acquisition_start() = 0;
    /// After the return no new frame is submitted; the one in work is abandoned if `abort`, else finished.
    virtual void acquisition_stop(bool abort) = 0;
    [[nodiscard]] virtual bool acquiring() const = 0;

    /// SFNC TriggerSoftware at `edge`. False when it was not accepted (not armed, other source,
    /// over-trigger); the camera counts that as a missed trigger.
    virtual bool software_trigger(Time edge) = 0;
    /// SFNC Action1 at `edge`; the same rules. A camera without it never accepts.
    virtual bool action_trigger(Time /*edge*/) { return false; }
};

} // namespace obscura
