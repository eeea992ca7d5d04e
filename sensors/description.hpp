// SPDX-License-Identifier: Apache-2.0
// Sensor description: readout timing and detector parameters as plain data, as read from a sensor file.
#pragma once

#include "core/spectral_band.hpp"
#include "core/text/enum_names.hpp"
#include "models/values/model_values.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace obscura {

namespace models {
struct ModelValues;
class TimingProgram;
} // namespace models

/// `rolling`: a reset pointer runs ahead of the read pointer. `global`: all rows are exposed together, then
/// read. `push_broom`: one row is read repeatedly at the line rate; a window's height counts lines.
/// `model`: as ReadoutSettings::timing says.
enum class Shutter : std::uint8_t { rolling, global, push_broom, model };
constexpr auto enum_names(Shutter /*type*/) {
    return std::array{EnumName{Shutter::rolling, "rolling"}, EnumName{Shutter::global, "global"},
                      EnumName{Shutter::push_broom, "push-broom"}, EnumName{Shutter::model, "model"}};
}

/// Readout of several windows under a rolling shutter. `sequential`: one window after the other, each with
/// its own reset scan. `interleaved`: all windows in every cycle of an on-chip sequencer, each with its own
/// resets.
enum class WindowMode : std::uint8_t { sequential, interleaved };
constexpr auto enum_names(WindowMode /*type*/) {
    return std::array{EnumName{WindowMode::sequential, "sequential"},
                      EnumName{WindowMode::interleaved, "interleaved"}};
}

/// Readout timing of a chip. T_row = row_overhead + ceil(width / outputs) / pixel_clock.
struct ReadoutSettings {
    std::int32_t width = 1024, height = 1024; ///< the whole array, pixels
    Shutter shutter = Shutter::rolling;
    /// Times by Shutter::model, and what they were made of.
    std::shared_ptr<const models::TimingProgram> timing{};
    std::shared_ptr<const models::ModelValues> timing_values{};
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
    std::int64_t exposure_max_ns = 0;    ///< longest exposure that the chip's counter holds; 0: any
    double line_rate_hz = 1000;          ///< push-broom
    std::int32_t window_step = 1;        ///< x and y of a window are multiples of this
    bool strict = true;                  ///< refuse impossible windows; otherwise crop and align them
};

/// Temperature law of dark current: doubling every dark_doubling_k kelvin, or the band gap of silicon.
enum class DarkLaw : std::uint8_t { doubling, band_gap };
constexpr auto enum_names(DarkLaw /*type*/) {
    return std::array{EnumName{DarkLaw::doubling, "doubling"}, EnumName{DarkLaw::band_gap, "band-gap"}};
}
/// A hard reset leaves kTC noise; a soft reset leaves half of its variance, and image lag.
enum class ResetMode : std::uint8_t { hard, soft };
constexpr auto enum_names(ResetMode /*type*/) {
    return std::array{EnumName{ResetMode::hard, "hard"}, EnumName{ResetMode::soft, "soft"}};
}
enum class TestPattern : std::uint8_t { off, ramp };
constexpr auto enum_names(TestPattern /*type*/) {
    return std::array{EnumName{TestPattern::off, "off"}, EnumName{TestPattern::ramp, "ramp"}};
}

/// Detector parameters, by EMVA 1288 names and symbols. An effect whose parameter is 0 is off.
struct DetectorSettings {
    // Light
    double transmission = 1;                                      ///< of the optics
    std::vector<SpectralPoint> quantum_efficiency{{550e-9, 0.5}}; ///< eta; linear between, ends held
    double fill_factor = 1;                                       ///< where the curve does not include it
    double prnu_local = 0;                                        ///< relative rms of the response, white
    double prnu_global = 0; ///< relative rms of the response, structured: bowl, gradient, columns, fields
    /// Relative amplitudes in prnu_global, see response_pattern().
    double prnu_bowl_weight = 1, prnu_gradient_weight = 0.5, prnu_column_weight = 0.15;
    double prnu_stitching_weight = 0.3;
    std::int32_t stitch_columns = 1, stitch_rows = 1; ///< fields of a stitched exposure
    /// Fraction of a pixel's charge that each of 4 edge neighbours gets.
    double crosstalk_edge = 0;
    double crosstalk_corner = 0; ///< fraction that each of 4 diagonal neighbours gets
    /// Global shutter: sensitivity of the storage node to light, relative to the pixel.
    double parasitic_light = 0;
    std::int64_t smear_row_ns = 0;          ///< frame transfer: time per row shift while the array is exposed
    std::int32_t optical_black_rows = 0;    ///< shielded rows after the electrical black rows: no light
    std::int32_t electrical_black_rows = 0; ///< first rows of the array: no charge at all

    // Dark current; values at the reference temperature
    double temperature_c = 20;
    double dark_reference_c = 20;
    DarkLaw dark_law = DarkLaw::doubling;
    double dark_doubling_k = 8;
    double dark_current_e_per_s = 5;       ///< mean over the array
    double dark_nonuniformity_e_per_s = 0; ///< rms over the array, log-normal
    double hot_fraction = 0;               ///< fraction of hot pixels
    double hot_current_e_per_s = 0;        ///< mean of their additional current, exponentially distributed
    /// Fraction of pixels with two-level RTS noise of the dark current.
    double rts_fraction = 0;
    double rts_current_e_per_s = 0; ///< mean distance of the two levels, exponentially distributed

    // Particles
    double hit_flux_per_cm2_s = 0;
    double hit_depth_m = 10e-6;       ///< of the sensitive layer
    double hit_charge_e_per_m = 80e6; ///< mean along a track

    // Charge
    double full_well_e = 50'000;
    /// Fraction of the charge above full well that goes to the 4 neighbours.
    double blooming = 0;
    std::array<double, 4> nonlinearity{}; ///< S = N (1 - c1 x - ... - c4 x^4), x = N / full well
    double lag = 0;                       ///< fraction of a frame's charge that appears in the next frame

    // Noise and offsets
    double read_noise_e = 8;            ///< amplifier, per sample
    bool double_sampling = false;       ///< a destructive read subtracts the reset level that follows
    double conversion_gain_v_per_e = 0; ///< of the sense node, C = q / conversion gain; 0: no reset noise
    ResetMode reset_mode = ResetMode::hard;
    double offset_fpn_e = 0; ///< rms of the pixels' offsets
    double column_fpn_e = 0; ///< rms of the columns' offsets
    double row_noise_e = 0;  ///< temporal, common to a row
    /// Fraction of pixels with RTS noise of the source follower (a trap in the transistor's channel): one of
    /// two values in a single sample, one of three in the difference of two.
    double follower_rts_fraction = 0;
    double follower_rts_e = 0; ///< mean distance of the two levels, exponentially distributed

    // Conversion
    double gain_dn_per_e = 0.08; ///< K at 0 dB
    double offset_dn = 64;       ///< black level
    int adc_bits = 12;
    double adc_inl_dn = 0; ///< peak deviation of the transfer curve
    double adc_dnl_dn = 0; ///< rms deviation of the code widths

    // Defects
    double dead_fraction = 0;  ///< pixels without response
    double stuck_fraction = 0; ///< pixels with a constant digital number
    std::int32_t dead_rows = 0, dead_columns = 0;

    TestPattern test_pattern = TestPattern::off; ///< ramp: (x + y) mod 2^bits instead of the image

    // Measured maps (FITS) in place of the generated ones; empty: generated from the serial
    std::string response_map; ///< relative response, mean 1
    std::string dark_map;     ///< e-/s at the reference temperature
    std::string offset_map;   ///< e-
};

/// A whole sensor.
struct SensorDescription {
    std::string file; ///< sensor file that the other figures override; empty: none
    std::string name = "generic";
    std::uint64_t serial = 1;      ///< seeds the fixed patterns
    double pixel_pitch_m = 5.5e-6; ///< of the columns
    double pixel_pitch_y_m = 0;    ///< of the rows; 0: pixel_pitch_m, square pixels
    [[nodiscard]] double row_pitch_m() const { return pixel_pitch_y_m > 0 ? pixel_pitch_y_m : pixel_pitch_m; }
    ReadoutSettings readout;
    DetectorSettings detector;
    models::ModelValues model; ///< of kind sensor: response of the pixels that a user has written
};

} // namespace obscura
