// The sensor as plain data: what a sensor file says; readout and detector are built from it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace obscura {

/// `rolling`: a reset pointer runs ahead of the read pointer. `global`: all rows are exposed together, then
/// read. `push_broom`: one row is read over and over, at the line rate; a window's height counts lines.
enum class Shutter : std::uint8_t { rolling, global, push_broom };

/// How a rolling shutter serves several windows: one after the other, each with its own reset scan, or all of
/// them in every cycle of an on-chip sequencer, each with resets of its own.
enum class WindowMode : std::uint8_t { sequential, interleaved };

/// Readout timing of a chip. T_row = row_overhead + ceil(width / outputs) / pixel_clock.
struct ReadoutSettings {
    std::int32_t width = 1024, height = 1024; ///< the whole array, pixels
    Shutter shutter = Shutter::rolling;
    double pixel_clock_hz = 40e6;
    std::int32_t outputs = 1;
    std::int64_t row_overhead_ns = 1000;
    std::int64_t sample_instant_ns = 200; ///< o_S: signal sample inside a row slot
    std::int64_t reset_instant_ns = 400;  ///< o_R: reset inside a row slot, o_S < o_R < row_overhead
    std::int64_t frame_overhead_ns = 0;   ///< global shutter: charge transfer between exposure and readout
    bool overlapped = true;               ///< the next exposure may start while this frame is read out
    WindowMode window_mode = WindowMode::sequential;
    std::int32_t windows_max = 32;
    std::int64_t window_overhead_ns = 0; ///< after the last row of each window
    std::int32_t blanking_rows = 0;      ///< idle row slots at the end of each cycle
    bool stretch_blanking = true;        ///< add idle slots for an exposure that is longer than the cycle
    std::int64_t exposure_step_ns = 1;   ///< global shutter and push-broom: exposures are multiples of this
    double line_rate_hz = 1000;          ///< push-broom
    std::int32_t window_step = 1;        ///< x and y of a window are multiples of this
    bool strict = true;                  ///< refuse impossible windows; otherwise crop and align them
};

/// One point of a tabulated curve over wavelength.
struct SpectralPoint {
    double wavelength_m = 0;
    double value = 0;
};

/// What happens to the charge. EMVA 1288 names and symbols.
struct DetectorSettings {
    double transmission = 1; ///< of the optics, 0..1
    std::vector<SpectralPoint> quantum_efficiency{
        {550e-9, 0.5}}; ///< eta x fill factor; linear between, ends held
    double full_well_e = 50'000;
    double dark_current_e_per_s = 5;
    double read_noise_e = 8;     ///< sigma_d, temporal, per read
    double gain_dn_per_e = 0.08; ///< K at 0 dB
    double offset_dn = 64;       ///< black level
    int adc_bits = 12;
};

/// A whole sensor.
struct SensorDescription {
    std::string name = "generic";
    std::uint64_t serial = 1; ///< seeds the fixed patterns
    double pixel_pitch_m = 5.5e-6;
    ReadoutSettings readout;
    DetectorSettings detector;
};

} // namespace obscura
