// SPDX-License-Identifier: Apache-2.0
// Sampling of a row: draws of its charge, lag, noise and conversion in each of the ways to read it.
#include "sensors/band_exposure.hpp"
#include "sensors/streams.hpp"

#include <array>
#include <cmath>
#include <cstring>
#include <numbers>

namespace obscura::sensors {
namespace {

/// Variance in e-^2 from which one draw combines shot noise and Gaussian noise (kernels::merged_row()).
constexpr float merged_variance_e2 = 400;

/// Weight of read `read` in the charge collected between the first and the last of `reads` equally spaced
/// reads: least-squares slope times the time between first and last.
double ramp_weight(std::int32_t read, std::int32_t reads) {
    const double n = reads;
    return 12 * (read - (n - 1) / 2) * (n - 1) / (n * (n * n - 1));
}

} // namespace

/// Adds the errors of a sample at time `sample` with weight `weight` to `sum`. `signal`: charge in the
/// sample, null: reset level.
void BandExposure::add_sample_effects(std::int32_t array_row, Time sample, double weight, const float* signal,
                                      float* sum) const noexcept {
    if (d_.sample_effects.empty()) return;
    RowSample row;
    row.array_row = array_row;
    row.first_column = plan_.windows[window_].sensor.x;
    row.columns = n_;
    row.seed = d_.noise_key;
    row.time_s =
        static_cast<double>(frame_) * to_seconds(plan_.frame_period_ns) + to_seconds(sample - plan_.trigger);
    row.weight = static_cast<float>(weight);
    row.signal_e = signal;
    for (const auto& effect : d_.sample_effects)
        effect->add(row, sum);
}

void BandExposure::add_lag(std::int32_t array_row, float* charge) noexcept {
    float* const before = d_.memory.data() +
                          static_cast<std::size_t>(array_row) * static_cast<std::size_t>(d_.sensor_width) +
                          static_cast<std::size_t>(plan_.windows[window_].sensor.x);
    float* const copy = scratch_.signal();
    std::memcpy(copy, before, n_ * sizeof(float));
    kernels::lag_row(static_cast<float>(d_.settings.lag), chain_.full_well_e, n_, charge, copy);
    std::memcpy(before, copy, n_ * sizeof(float));
}

/// Draws Poisson counts (electrons) and normals of one read of the current row.
void BandExposure::draw(const float* mean, std::int32_t array_row, std::uint32_t read,
                        float* counts) noexcept {
    const auto pixel = static_cast<std::uint32_t>(array_row) * static_cast<std::uint32_t>(d_.sensor_width) +
                       static_cast<std::uint32_t>(plan_.windows[window_].sensor.x);
    kernels::poisson_row(mean, n_,
                         stream_of(Effect::shot_and_read, d_.noise_key, frame_, pixel, read, layer_), counts,
                         scratch_.z0(), scratch_.z1(), scratch_.sampler());
}

/// Draws shot noise and the noise of amplifier and reset together. Valid only away from full well, where no
/// non-linear step lies between the two. `chain` keeps the noise that is still to be added.
void BandExposure::draw_merged(const float* mean, std::int32_t array_row, kernels::Chain& chain,
                               float* charge) noexcept {
    const float variance = chain.sigma0_e * chain.sigma0_e + chain.sigma1_e * chain.sigma1_e;
    const auto pixel = static_cast<std::uint32_t>(array_row) * static_cast<std::uint32_t>(d_.sensor_width) +
                       static_cast<std::uint32_t>(plan_.windows[window_].sensor.x);
    kernels::merged_row(mean, variance, n_,
                        stream_of(Effect::shot_and_gauss, d_.noise_key, frame_, pixel, 0, layer_), charge,
                        scratch_.z0());
    const float full = chain.full_well_e;
    const float limit = full - 9 * std::sqrt(full + variance);
    if (!kernels::any_above(mean, limit, n_)) {
        chain.sigma0_e = chain.sigma1_e = 0;
        return;
    }
    float* const counts = scratch_.frozen();
    draw(mean, array_row, 0, counts);
    float* const z0 = scratch_.z0();
    float* const z1 = scratch_.z1();
    for (std::size_t x = 0; x < n_; ++x) {
        if (mean[x] > limit)
            charge[x] = counts[x];
        else
            z0[x] = z1[x] = 0;
    }
}

/// Puts the stage of the sensor's model for a row of the window into `out`, which may be `in`.
void BandExposure::run_model(models::SensorStage stage, std::int32_t array_row, std::uint32_t read,
                             const float* in, float* out) noexcept {
    const std::int32_t x = plan_.windows[window_].sensor.x;
    const auto pixel = static_cast<std::uint32_t>(array_row) * static_cast<std::uint32_t>(d_.sensor_width) +
                       static_cast<std::uint32_t>(x);
    values_replaced_ +=
        d_.model->apply(stage, {x, array_row, pixel, d_.noise_key, frame_, read, layer_}, in, n_, out);
}

/// Full well and non-linearity, or the model in their place.
void BandExposure::collect(std::int32_t array_row, std::uint32_t read, float* charge) noexcept {
    if (has_model(models::SensorStage::collect))
        run_model(models::SensorStage::collect, array_row, read, charge, charge);
    else
        kernels::collect_row(chain_, n_, charge);
}

/// kernels::convert_row() with the model before the converter; `signal` is overwritten.
void BandExposure::convert(const kernels::Chain& chain, float* signal, const float* offset, const float* z0,
                           const float* z1, std::int32_t array_row, std::uint32_t read,
                           std::uint16_t* dn) noexcept {
    if (!has_model(models::SensorStage::convert)) {
        kernels::convert_row(chain, signal, offset, z0, z1, n_, dn);
        return;
    }
    // In the order of kernels::convert_row().
    for (std::size_t i = 0; i < n_; ++i) {
        float v = signal[i] + chain.row_e;
        if (offset != nullptr) v += chain.offset_scale * offset[i];
        if (z0 != nullptr) v += chain.sigma0_e * z0[i];
        if (z1 != nullptr) v += chain.sigma1_e * z1[i];
        signal[i] = v * chain.gain_dn_per_e + chain.black_dn;
    }
    run_model(models::SensorStage::convert, array_row, read, signal, signal);
    kernels::Chain converter = chain;
    converter.row_e = converter.black_dn = 0;
    converter.gain_dn_per_e = 1;
    kernels::convert_row(converter, signal, nullptr, nullptr, nullptr, n_, dn);
}

float BandExposure::row_noise(std::int32_t array_row, std::uint32_t read) noexcept {
    if (d_.settings.row_noise_e == 0) return 0;
    const auto rms = static_cast<float>(d_.settings.row_noise_e);
    const auto draw_rows = [&](std::int32_t first, std::size_t rows, float* out) {
        std::array<float, noise_rows + kernels::padding> other;
        kernels::normal_row(rows,
                            stream_of(Effect::row_noise, d_.noise_key, frame_,
                                      static_cast<std::uint32_t>(first), read, layer_),
                            out, other.data());
    };
    if (read != 0) {
        std::array<float, 1 + kernels::padding> one;
        draw_rows(array_row, 1, one.data());
        return rms * one[0];
    }
    if (noise_row_ < 0 || array_row < noise_row_ ||
        array_row >= noise_row_ + static_cast<std::int32_t>(noise_rows)) {
        noise_row_ = array_row;
        draw_rows(array_row, noise_rows, row_noise_.data());
    }
    return rms * row_noise_[static_cast<std::size_t>(array_row - noise_row_)];
}

void BandExposure::note(const float* mean, const float* charge, const ExposureTruth& truth) noexcept {
    const float full = chain_.full_well_e;
    if (kernels::any_above(charge, std::nextafter(full, 0.0F), n_))
        saturated_windows_ |= std::uint32_t{1} << window_;
    if (!truth.mean_e.empty()) std::memcpy(truth.mean_e.data(), mean, n_ * sizeof(float));
    if (!truth.saturated.empty())
        for (std::size_t x = 0; x < n_; ++x)
            truth.saturated[x] = charge[x] >= full ? 1 : 0;
}

/// Destructive read, or difference of two non-destructive reads: one draw for the charge of the whole
/// interval.
void BandExposure::sample_once(std::int32_t row, bool difference, std::uint16_t* dn,
                               const ExposureTruth& truth) noexcept {
    const DetectorSettings& s = d_.settings;
    const std::int32_t array_row = plan_.sensor_row[static_cast<std::size_t>(row)];
    float* mean = mean_of_exposure(row);
    if (s.blooming > 0 && !difference) mean = bloom(row, mean, scratch_.sum());
    if (s.smear_row_ns > 0) {
        if (mean != scratch_.sum()) std::memcpy(scratch_.sum(), mean, wide_ * sizeof(float));
        mean = scratch_.sum();
        add_smear(mean);
    }
    mean += left_;
    if (has_model(models::SensorStage::light)) {
        // Rows of mean charge serve their neighbours, too.
        float* const modelled = s.smear_row_ns > 0 ? mean : scratch_.sum();
        run_model(models::SensorStage::light, array_row, 0, mean, modelled);
        mean = modelled;
    }
    // Double sampling subtracts a second amplifier sample and, for a destructive read, another reset level;
    // the difference of two reads after one reset has neither reset noise nor offset.
    const bool two = difference || s.double_sampling;
    const double doubled = two ? std::numbers::sqrt2 : 1;
    kernels::Chain chain = chain_;
    chain.sigma0_e = static_cast<float>(s.read_noise_e * doubled);
    chain.sigma1_e = difference ? 0 : static_cast<float>(d_.reset_e * doubled);
    chain.offset_scale = difference ? 0 : 1;
    chain.row_e = row_noise(array_row, 0);
    float* const charge = scratch_.counts();
    // The model of the charge lies between the two noises.
    const bool apart = has_model(models::SensorStage::collect);
    if (!apart && chain.sigma0_e * chain.sigma0_e + chain.sigma1_e * chain.sigma1_e >= merged_variance_e2)
        draw_merged(mean, array_row, chain, charge);
    else
        draw(mean, array_row, 0, charge);
    if (s.lag > 0 && !difference) add_lag(array_row, charge);
    note(mean, charge, truth);
    collect(array_row, 0, charge);
    const RowTime& t = plan_.rows[static_cast<std::size_t>(row)];
    add_sample_effects(array_row, t.read, 1, charge, charge);
    if (two)
        add_sample_effects(array_row, difference ? t.reset : t.read + d_.reset_sample_ns, -1, nullptr,
                           charge);
    const float* const offset =
        difference ? nullptr
                   : d_.pattern.row_of(d_.pattern.offset_e, array_row, plan_.windows[window_].sensor.x);
    convert(chain, charge, offset, chain.sigma0_e > 0 ? scratch_.z0() : nullptr,
            chain.sigma1_e > 0 ? scratch_.z1() : nullptr, array_row, 0, dn);
}

/// Adds the charge of read `k`, from `from` to `to`, and its mean to what the row has collected.
void BandExposure::add_read(std::int32_t row, Time from, Time to, std::int32_t k, float* charge,
                            float* total_mean) noexcept {
    float* const mean = scratch_.mean(0);
    mean_row_.fill(no_row);
    mean_between(row, from, to, mean);
    const std::int32_t array_row = plan_.sensor_row[static_cast<std::size_t>(row)];
    const auto read = static_cast<std::uint32_t>(k);
    if (has_model(models::SensorStage::light))
        run_model(models::SensorStage::light, array_row, read, mean + left_, mean + left_);
    draw(mean + left_, array_row, read, scratch_.counts());
    kernels::accumulate_row(scratch_.counts(), 1, n_, charge);
    kernels::accumulate_row(mean + left_, 1, n_, total_mean);
}

/// One of several non-destructive reads: charge accumulates from read to read, the reset noise is the same in
/// all of them.
void BandExposure::sample_read(std::int32_t row, std::uint16_t* dn, const ExposureTruth& truth) noexcept {
    const DetectorSettings& s = d_.settings;
    const auto i = static_cast<std::size_t>(row);
    const FrameWindow& window = plan_.windows[window_];
    const std::int32_t array_row = plan_.sensor_row[i];
    float* const charge = scratch_.sum();
    float* const total_mean = scratch_.excess();
    std::fill_n(charge, n_ + kernels::padding, 0.0F);
    std::fill_n(total_mean, n_ + kernels::padding, 0.0F);
    Time from = plan_.rows[i].reset;
    for (std::int32_t k = 0; k <= window.read_index; ++k) {
        const Time to = plan_.rows[i].read - (window.read_index - k) * window.read_spacing_ns;
        // Another window reset the row in between: this read contains no charge from before that reset.
        if (to <= from) continue;
        add_read(row, from, to, k, charge, total_mean);
        if (from == plan_.rows[i].reset) std::memcpy(scratch_.frozen(), scratch_.z1(), n_ * sizeof(float));
        from = to;
    }
    note(total_mean, charge, truth);
    const auto read = static_cast<std::uint32_t>(window.read_index);
    collect(array_row, read, charge);
    add_sample_effects(array_row, plan_.rows[i].read, 1, charge, charge);
    kernels::Chain chain = chain_;
    chain.sigma0_e = static_cast<float>(s.read_noise_e);
    chain.sigma1_e = static_cast<float>(d_.reset_e);
    chain.offset_scale = 1;
    chain.row_e = row_noise(array_row, read);
    convert(chain, charge, d_.pattern.row_of(d_.pattern.offset_e, array_row, window.sensor.x), scratch_.z0(),
            scratch_.frozen(), array_row, read, dn);
}

/// Least-squares slope of equally spaced reads, sampling up the ramp.
void BandExposure::sample_ramp(std::int32_t row, std::uint16_t* dn, const ExposureTruth& truth) noexcept {
    const auto i = static_cast<std::size_t>(row);
    const FrameWindow& window = plan_.windows[window_];
    const std::int32_t array_row = plan_.sensor_row[i];
    float* const charge = scratch_.sum();
    float* const total_mean = scratch_.excess();
    float* const fitted = scratch_.frozen();
    for (float* row_buffer : {charge, total_mean, fitted})
        std::fill_n(row_buffer, n_ + kernels::padding, 0.0F);
    const std::int64_t span = plan_.rows[i].exposure_ns();
    double squares = ramp_weight(0, window.reads) * ramp_weight(0, window.reads);
    add_sample_effects(array_row, plan_.rows[i].reset, ramp_weight(0, window.reads), nullptr, fitted);
    for (std::int32_t k = 1; k < window.reads; ++k) {
        const Time from = plan_.rows[i].reset + span * (k - 1) / (window.reads - 1);
        const Time to = plan_.rows[i].reset + span * k / (window.reads - 1);
        add_read(row, from, to, k, charge, total_mean);
        std::memcpy(scratch_.signal(), charge, n_ * sizeof(float));
        collect(array_row, static_cast<std::uint32_t>(k), scratch_.signal());
        const double weight = ramp_weight(k, window.reads);
        squares += weight * weight;
        add_sample_effects(array_row, to, weight, scratch_.signal(), fitted);
        kernels::accumulate_row(scratch_.signal(), static_cast<float>(weight), n_, fitted);
    }
    note(total_mean, charge, truth);
    kernels::Chain chain = chain_;
    chain.sigma0_e = static_cast<float>(d_.settings.read_noise_e * std::sqrt(squares));
    chain.row_e = row_noise(array_row, 0);
    convert(chain, fitted, nullptr, scratch_.z0(), nullptr, array_row, 0, dn);
}

} // namespace obscura::sensors
