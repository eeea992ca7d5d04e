// SPDX-License-Identifier: Apache-2.0
// Exposure of one block of rows: from irradiance through charge to digital numbers.
#pragma once

#include "sensors/detector_state.hpp"
#include "sensors/kernels.hpp"
#include "sensors/scratch.hpp"
#include "sensors/sensor.hpp"

#include <array>
#include <cstdint>
#include <limits>

namespace obscura::sensors {

/// Lives for one call of Detector::expose(); thread-bound, neither allocates nor throws. Rows must be exposed
/// from the top down, so that rows which spread charge into each other are computed once. Order of the
/// effects: photons, crosstalk, response, dark current and its RTS noise, particles, blooming and smear,
/// light() of a model, Poisson draw, lag, full well and non-linearity or collect() of a model, reset, row and
/// amplifier noise, offsets, sampling, gain, black level, convert() of a model, ADC, defects.
class BandExposure {
public:
    BandExposure(DetectorState& detector, const ReadoutPlan& plan, const IrradianceBand& light,
                 std::uint64_t frame, const AnalogSettings& analog, Scratch& scratch) noexcept;

    /// Exposes row `row` of the composed image. `dn` has room for a whole row; `truth` covers the row or is
    /// empty.
    void expose_row(std::int32_t row, std::uint16_t* dn, const ExposureTruth& truth) noexcept;

    /// Bit w: a pixel of window w has reached full well.
    [[nodiscard]] std::uint32_t saturated_windows() const noexcept { return saturated_windows_; }
    /// See Detector::values_replaced(), of these rows.
    [[nodiscard]] std::uint64_t values_replaced() const noexcept { return values_replaced_; }

private:
    void enter_window(std::int32_t row) noexcept;
    [[nodiscard]] std::size_t planned(std::int32_t row) const noexcept;
    [[nodiscard]] std::int32_t row_on_array(std::int32_t row) const noexcept;
    [[nodiscard]] const float* raw_light(std::int32_t row) noexcept;
    void weigh_exposures(std::int32_t row, float* light) const noexcept;
    [[nodiscard]] const float* light(std::int32_t row) noexcept;
    void mean_between(std::int32_t row, Time begin, Time end, float* out) noexcept;
    [[nodiscard]] float* mean_of_exposure(std::int32_t row) noexcept;
    void add_dark_rts(std::int32_t array_row, double seconds, float* out) const noexcept;
    void add_hits(std::int32_t array_row, Time begin, Time end, float* out) const noexcept;
    [[nodiscard]] float* bloom(std::int32_t row, float* mean, float* out) noexcept;
    void add_smear(float* out) noexcept;
    void add_sample_effects(std::int32_t array_row, Time sample, double weight, const float* signal,
                            float* sum) const noexcept;
    void add_lag(std::int32_t array_row, float* charge) noexcept;
    void draw(const float* mean, std::int32_t array_row, std::uint32_t read, float* counts) noexcept;
    void draw_merged(const float* mean, std::int32_t array_row, kernels::Chain& chain,
                     float* charge) noexcept;
    [[nodiscard]] bool has_model(models::SensorStage stage) const noexcept {
        return d_.model && d_.model->has(stage);
    }
    void run_model(models::SensorStage stage, std::int32_t array_row, std::uint32_t read, const float* in,
                   float* out) noexcept;
    void collect(std::int32_t array_row, std::uint32_t read, float* charge) noexcept;
    void convert(const kernels::Chain& chain, float* signal, const float* offset, const float* z0,
                 const float* z1, std::int32_t array_row, std::uint32_t read, std::uint16_t* dn) noexcept;
    [[nodiscard]] float row_noise(std::int32_t array_row, std::uint32_t read) noexcept;
    [[nodiscard]] bool has_full(std::int32_t row) noexcept;

    void sample_once(std::int32_t row, bool difference, std::uint16_t* dn,
                     const ExposureTruth& truth) noexcept;
    void sample_read(std::int32_t row, std::uint16_t* dn, const ExposureTruth& truth) noexcept;
    void add_read(std::int32_t row, Time from, Time to, std::int32_t k, float* charge,
                  float* total_mean) noexcept;
    void sample_ramp(std::int32_t row, std::uint16_t* dn, const ExposureTruth& truth) noexcept;
    void note(const float* mean, const float* charge, const ExposureTruth& truth) noexcept;
    void apply_defects(std::int32_t array_row, std::uint16_t* dn) const noexcept;

    DetectorState& d_;
    const ReadoutPlan& plan_;
    const IrradianceBand& band_;
    std::uint64_t frame_;
    Scratch& scratch_;
    kernels::Chain chain_;
    Time frame_begin_, frame_end_;
    bool hits_listed_ = false;
    std::uint32_t saturated_windows_ = 0;
    std::uint64_t values_replaced_ = 0;
    // The window of the current row.
    std::size_t window_ = SIZE_MAX;
    std::int32_t first_row_ = 0, last_row_ = 0; ///< of the composed image
    std::int32_t lowest_ = 0, highest_ = 0;     ///< rows with light, halo included
    std::size_t n_ = 0;                         ///< columns of the window
    std::size_t left_ = 0, wide_ = 0;           ///< halo columns on the left; columns with the halo
    std::int32_t wide_x_ = 0;                   ///< array column of the first halo column
    std::uint32_t layer_ = 0;
    bool smear_known_ = false;
    static constexpr std::size_t noise_rows = 64;
    std::int32_t noise_row_ = -1; ///< first array row of row_noise_, for reads numbered 0
    std::array<float, noise_rows + kernels::padding> row_noise_{};
    /// Row of a ring slot that holds none.
    static constexpr std::int32_t no_row = std::numeric_limits<std::int32_t>::min();
    std::array<std::int32_t, Scratch::ring> full_row_{}; ///< rows already tested for pixels above full well
    std::array<bool, Scratch::ring> full_{};
    std::array<std::int32_t, Scratch::ring> raw_row_{}, mean_row_{}; ///< row held by each ring slot
};

} // namespace obscura::sensors
