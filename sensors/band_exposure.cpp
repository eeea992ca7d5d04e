// SPDX-License-Identifier: Apache-2.0
#include "sensors/band_exposure.hpp"

#include "models/kinds/timing_program.hpp"
#include "sensors/rts_noise.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstring>

namespace obscura::sensors {
namespace {

/// Ring slot of a row, which may be a halo row above the image (negative).
std::size_t slot_of(std::int32_t row) {
    return static_cast<std::uint32_t>(row) % Scratch::ring;
}

bool intersect(const Region& a, const Region& b) {
    return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

} // namespace

BandExposure::BandExposure(DetectorState& detector, const ReadoutPlan& plan, const IrradianceBand& light,
                           std::uint64_t frame, const AnalogSettings& analog, Scratch& scratch) noexcept
    : d_(detector), plan_(plan), band_(light), frame_(frame), scratch_(scratch) {
    const DetectorSettings& s = d_.settings;
    chain_.full_well_e = static_cast<float>(s.full_well_e);
    chain_.inverse_full_well = static_cast<float>(1 / s.full_well_e);
    for (std::size_t i = 0; i < 4; ++i)
        chain_.nonlinearity[i] = static_cast<float>(s.nonlinearity[i]);
    chain_.gain_dn_per_e = static_cast<float>(s.gain_dn_per_e * std::pow(10.0, analog.gain_db / 20));
    chain_.black_dn = static_cast<float>(s.offset_dn + analog.black_shift_dn);
    chain_.top_dn = static_cast<float>((1 << s.adc_bits) - 1);
    if (!d_.adc.perfect()) {
        chain_.adc = d_.adc.codes();
        chain_.adc_steps = static_cast<float>(d_.adc.steps());
    }

    if (d_.particles.none()) return;
    frame_begin_ = plan.rows.front().reset;
    frame_end_ = plan.rows.front().read;
    for (const RowTime& t : plan.rows) {
        frame_begin_ = std::min(frame_begin_, t.reset);
        frame_end_ = std::max(frame_end_, t.read);
    }
    std::int32_t low = plan.sensor_row[static_cast<std::size_t>(light.first_row)], high = low;
    for (std::int32_t r = light.first_row; r < light.first_row + light.rows; ++r) {
        low = std::min(low, plan.sensor_row[static_cast<std::size_t>(r)]);
        high = std::max(high, plan.sensor_row[static_cast<std::size_t>(r)]);
    }
    scratch_.hits.clear();
    hits_listed_ = true;
    // Include two rows on either side: blooming brings charge in from neighbouring rows.
    d_.particles.each(d_.noise_key, frame_, frame_begin_, frame_end_, low - 2, high - low + 5,
                      [&](const ParticleHit& hit) {
                          if (scratch_.hits.size() < Scratch::hits_kept)
                              scratch_.hits.push_back(hit);
                          else
                              hits_listed_ = false; // too many: each row searches its own hits
                      });
}

void BandExposure::enter_window(std::int32_t row) noexcept {
    if (window_ != SIZE_MAX && row >= first_row_ && row <= last_row_) return;
    window_ = 0;
    while (window_ + 1 < plan_.windows.size() && plan_.windows[window_ + 1].image_y <= row)
        ++window_;
    const FrameWindow& w = plan_.windows[window_];
    first_row_ = w.image_y;
    last_row_ = w.image_y + w.sensor.height - 1;
    const std::int32_t band_last = band_.first_row + band_.rows - 1;
    lowest_ = band_.first_row < first_row_ ? first_row_ : band_.first_row - band_.halo_above;
    highest_ = band_last > last_row_ ? last_row_ : band_last + band_.halo_below;
    n_ = static_cast<std::size_t>(w.sensor.width);
    left_ = static_cast<std::size_t>(band_.halo_left);
    wide_ = n_ + static_cast<std::size_t>(band_.halo_left + band_.halo_right);
    wide_x_ = w.sensor.x - band_.halo_left;
    assert(wide_ <= static_cast<std::size_t>(band_.width) && wide_x_ >= 0 &&
           wide_x_ + static_cast<std::int32_t>(wide_) <= d_.sensor_width);
    // A pixel that several windows read gets independent random numbers in each of them.
    layer_ = 0;
    for (const FrameWindow& other : plan_.windows)
        if (other.request < w.request && other.read_index + 1 == other.reads &&
            intersect(other.sensor, w.sensor))
            ++layer_;
    smear_known_ = false;
    raw_row_.fill(no_row);
    mean_row_.fill(no_row);
    full_row_.fill(no_row);
    noise_row_ = -1;
}

/// Plan index of a row of the window; for a halo row, that of the nearest row of the window.
std::size_t BandExposure::planned(std::int32_t row) const noexcept {
    return static_cast<std::size_t>(std::clamp(row, first_row_, last_row_));
}

/// Array row of a row of the window or of its halo.
std::int32_t BandExposure::row_on_array(std::int32_t row) const noexcept {
    const std::size_t i = planned(row);
    return plan_.sensor_row[i] + (row - static_cast<std::int32_t>(i));
}

// Rows of light and of expected charge begin at the first halo column; rows after the random draw begin at
// the window's own first column.

/// Multiplies the light of pixels whose exposures are longer or shorter than that of their row.
void BandExposure::weigh_exposures(std::int32_t row, float* light) const noexcept {
    const TimedWindow& timed = plan_.timed_windows[window_];
    const models::TimedFrame frame{timed.region.height, timed.region.width, timed.exposure_ns};
    const auto of_row = static_cast<float>(plan_.rows[planned(row)].exposure_ns());
    const std::int32_t of_frame = static_cast<std::int32_t>(planned(row)) - first_row_;
    std::array<RowTime, 128> times;
    for (std::size_t at = 0; at < wide_; at += times.size()) {
        const std::span some = std::span(times).first(std::min(times.size(), wide_ - at));
        plan_.pixel_timing->fill_pixels(frame, of_frame,
                                        wide_x_ + static_cast<std::int32_t>(at) - timed.region.x, some);
        for (std::size_t i = 0; i < some.size(); ++i)
            light[at + i] *= static_cast<float>(some[i].exposure_ns()) / of_row;
    }
}

/// Electrons per second from light in a pixel of mean response, before crosstalk; padded by one copy of the
/// edge pixel on either side.
const float* BandExposure::raw_light(std::int32_t row) noexcept {
    row = std::clamp(row, lowest_, highest_);
    const std::size_t slot = slot_of(row);
    float* const out = scratch_.raw(slot);
    if (raw_row_[slot] == row) return out;
    raw_row_[slot] = row;

    const auto stride = static_cast<std::size_t>(band_.width);
    const auto stored_rows = static_cast<std::size_t>(band_.halo_above + band_.rows + band_.halo_below);
    const auto line = static_cast<std::size_t>(row - band_.first_row + band_.halo_above);
    for (std::size_t b = 0; b < d_.electrons_per_s.size(); ++b) {
        const std::size_t at = (b * stored_rows + line) * stride;
        const float* values = band_.values.data() + at;
        // Kernels read up to kernels::padding elements past the end of a row; the caller's memory may end
        // before that.
        if (at + wide_ + kernels::padding > band_.values.size()) {
            std::memcpy(scratch_.signal(), values, wide_ * sizeof(float));
            values = scratch_.signal();
        }
        kernels::light_row(values, nullptr, static_cast<float>(d_.electrons_per_s[b]), b > 0, wide_, out);
    }
    if (d_.electrons_per_s.empty()) std::fill_n(out, wide_, 0.0F);
    if (plan_.pixel_timing != nullptr) weigh_exposures(row, out);
    out[-1] = out[0];
    out[wide_] = out[wide_ - 1];
    return out;
}

const float* BandExposure::light(std::int32_t row) noexcept {
    const DetectorSettings& s = d_.settings;
    if (s.crosstalk_edge == 0 && s.crosstalk_corner == 0) return raw_light(row);
    const float* const above = raw_light(row - 1);
    const float* const here = raw_light(row);
    const float* const below = raw_light(row + 1);
    kernels::crosstalk_row(above, here, below, static_cast<float>(s.crosstalk_edge),
                           static_cast<float>(s.crosstalk_corner), wide_, scratch_.mixed());
    return scratch_.mixed();
}

void BandExposure::add_dark_rts(std::int32_t array_row, double seconds, float* out) const noexcept {
    // RTS time advances by the frame period per frame, independent of the trigger times: same frames, same
    // bytes.
    const double now_s = static_cast<double>(frame_) * to_seconds(plan_.frame_period_ns);
    for (const DarkRtsPixel& p : d_.pattern.dark_rts.row(array_row)) {
        const std::int32_t x = p.x - wide_x_;
        if (x < 0 || x >= static_cast<std::int32_t>(wide_)) continue;
        if (rts_is_high(d_.noise_key, p.pixel, static_cast<double>(p.time_constant_s), now_s))
            out[x] += static_cast<float>(static_cast<double>(p.current_e_per_s) * d_.dark_ratio * seconds);
    }
}

void BandExposure::add_hits(std::int32_t array_row, Time begin, Time end, float* out) const noexcept {
    if (d_.particles.none()) return;
    const auto add = [&](const ParticleHit& hit) {
        if (hit.time >= begin && hit.time < end)
            deposit(hit, array_row, wide_x_, static_cast<std::int32_t>(wide_), out);
    };
    if (hits_listed_)
        for (const ParticleHit& hit : scratch_.hits)
            add(hit);
    else
        d_.particles.each(d_.noise_key, frame_, frame_begin_, frame_end_, array_row - 1, 3, add);
}

/// Expected electrons of a row between two instants, without blooming and smear.
void BandExposure::mean_between(std::int32_t row, Time begin, Time end, float* out) noexcept {
    const DetectorSettings& s = d_.settings;
    const std::size_t i = planned(row);
    const std::int32_t y = row_on_array(row);
    if (y < s.electrical_black_rows) {
        std::fill_n(out, wide_, 0.0F);
        return;
    }
    const double seconds = to_seconds(end - begin);
    double lit_s = seconds;
    if (d_.global_shutter) lit_s += s.parasitic_light * to_seconds(plan_.release[i] - plan_.rows[i].read);
    if (y < s.electrical_black_rows + s.optical_black_rows) lit_s = 0;
    const float* const dark = d_.pattern.row_of(d_.pattern.dark_e_per_s, y, wide_x_);
    const double uniform = dark == nullptr ? s.dark_current_e_per_s : 1;
    const float* const response = d_.pattern.row_of(d_.pattern.response, y, wide_x_);
    kernels::mean_row(light(row), response, static_cast<float>(lit_s), dark,
                      static_cast<float>(uniform * d_.dark_ratio * seconds), wide_, out);
    add_dark_rts(y, seconds, out);
    add_hits(y, begin, end, out);
}

float* BandExposure::mean_of_exposure(std::int32_t row) noexcept {
    const std::size_t slot = slot_of(row);
    float* const out = scratch_.mean(slot);
    if (mean_row_[slot] == row) return out;
    mean_row_[slot] = row;
    const RowTime& t = plan_.rows[planned(row)];
    mean_between(row, t.reset, t.read, out);
    return out;
}

/// Whether the expected charge of a pixel of the row, which may lie in the halo, exceeds full well.
bool BandExposure::has_full(std::int32_t row) noexcept {
    if (row < lowest_ || row > highest_) return false;
    const std::size_t slot = slot_of(row);
    if (full_row_[slot] != row) {
        full_row_[slot] = row;
        full_[slot] = kernels::any_above(mean_of_exposure(row), chain_.full_well_e, wide_);
    }
    return full_[slot];
}

/// Blooming: writes to `out` `mean` plus a fraction of the charge that the four neighbours hold above full
/// well. Returns `mean` itself in the common case that there is no such charge.
float* BandExposure::bloom(std::int32_t row, float* mean, float* out) noexcept {
    const float full = chain_.full_well_e;
    const auto share = static_cast<float>(d_.settings.blooming / 4);
    const bool here = has_full(row), above = has_full(row - 1), below = has_full(row + 1);
    if (!here && !above && !below) return mean;

    const auto excess = [&](float charge) { return charge > full ? share * (charge - full) : 0.0F; };
    std::memcpy(out, mean, wide_ * sizeof(float));
    for (std::size_t x = 0; here && x < wide_; ++x) {
        const float spill = excess(mean[x]);
        if (spill == 0) continue;
        if (x > 0) out[x - 1] += spill;
        if (x + 1 < wide_) out[x + 1] += spill;
    }
    for (const std::int32_t neighbour : {row - 1, row + 1}) {
        if (!(neighbour < row ? above : below)) continue;
        const float* const other = mean_of_exposure(neighbour);
        for (std::size_t x = 0; x < wide_; ++x)
            out[x] += excess(other[x]);
    }
    return out;
}

/// Frame-transfer smear: on the way to the storage area each row is exposed to the light of the whole column.
void BandExposure::add_smear(float* out) noexcept {
    if (!smear_known_) {
        smear_known_ = true;
        float* const column = scratch_.smear();
        std::fill_n(column, wide_ + kernels::padding, 0.0F);
        raw_row_.fill(no_row);
        for (std::int32_t r = lowest_; r <= highest_; ++r)
            kernels::light_row(raw_light(r), d_.pattern.row_of(d_.pattern.response, row_on_array(r), wide_x_),
                               1, true, wide_, column);
        raw_row_.fill(no_row);
    }
    kernels::accumulate_row(scratch_.smear(), static_cast<float>(to_seconds(d_.settings.smear_row_ns)), wide_,
                            out);
}

void BandExposure::apply_defects(std::int32_t array_row, std::uint16_t* dn) const noexcept {
    const std::int32_t x0 = plan_.windows[window_].sensor.x;
    const auto n = static_cast<std::int32_t>(n_);
    for (const StuckPixel& p : d_.pattern.stuck.row(array_row))
        if (p.x >= x0 && p.x < x0 + n) dn[p.x - x0] = p.dn;
    if (!d_.pattern.dead_column.empty())
        for (std::int32_t x = 0; x < n; ++x)
            if (d_.pattern.dead_column[static_cast<std::size_t>(x0 + x)]) dn[x] = 0;
    if (!d_.pattern.dead_row.empty() && d_.pattern.dead_row[static_cast<std::size_t>(array_row)])
        std::fill_n(dn, n_, std::uint16_t{0});
}

void BandExposure::expose_row(std::int32_t row, std::uint16_t* dn, const ExposureTruth& truth) noexcept {
    enter_window(row);
    const FrameWindow& window = plan_.windows[window_];
    const std::int32_t array_row = plan_.sensor_row[static_cast<std::size_t>(row)];
    if (d_.settings.test_pattern == TestPattern::ramp) {
        const std::int32_t mask = (1 << d_.settings.adc_bits) - 1;
        for (std::size_t x = 0; x < n_; ++x)
            dn[x] = static_cast<std::uint16_t>((window.sensor.x + static_cast<std::int32_t>(x) + array_row) &
                                               mask);
    } else {
        std::uint16_t* const converted = scratch_.dn();
        switch (window.sampling) {
        case Sampling::destructive:
            sample_once(row, false, converted, truth);
            break;
        case Sampling::cds:
            sample_once(row, true, converted, truth);
            break;
        case Sampling::non_destructive:
            sample_read(row, converted, truth);
            break;
        case Sampling::ramp:
            sample_ramp(row, converted, truth);
            break;
        }
        std::memcpy(dn, converted, n_ * sizeof(std::uint16_t));
        apply_defects(array_row, dn);
    }
    std::fill(dn + n_, dn + plan_.width, std::uint16_t{0});
}

} // namespace obscura::sensors
