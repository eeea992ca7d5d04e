// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "sensors/band_exposure.hpp"
#include "sensors/dark_current.hpp"
#include "sensors/photometry.hpp"
#include "sensors/sensor_file.hpp"
#include "sensors/streams.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

namespace obscura::sensors {

namespace {

const SensorDescription& checked(const SensorDescription& d, double aperture_m) {
    std::string why = explain_invalid(d);
    if (why.empty() && !(aperture_m >= 0 && aperture_m <= 1e3))
        why = fmt::format("aperture_m: {}, allowed 0 to 1000", aperture_m);
    if (!why.empty()) throw ConfigError(fmt::format("sensor {}: {}", d.name, why));
    return d;
}

} // namespace

DetectorState::DetectorState(const SensorDescription& d, std::span<const SpectralBand> bands,
                             double aperture_m, std::uint64_t the_seed)
    : settings(checked(d, aperture_m).detector),
      sensor_width(d.readout.width),
      sensor_height(d.readout.height),
      global_shutter(d.readout.shutter == Shutter::global),
      seed(the_seed),
      noise_key(run_key(the_seed, 0)),
      pattern(d),
      sample_effects(make_sample_effects(d)),
      particles(d),
      adc(d),
      scratch(static_cast<std::size_t>(d.readout.width)),
      reset_sample_ns(d.readout.reset_instant_ns - d.readout.sample_instant_ns),
      dark_ratio(dark_current_ratio(settings, settings.temperature_c, settings.dark_reference_c)),
      reset_e(reset_noise_e(settings)) {
    for (const SpectralBand& band : bands)
        band_electrons_per_joule.push_back(electrons_per_joule(settings.quantum_efficiency, band));
    electrons_per_s.resize(bands.size());
    set_aperture(aperture_m);
    if (d.model.loaded != nullptr) model.emplace(d);
    if (settings.lag > 0)
        memory.assign(static_cast<std::size_t>(sensor_width) * static_cast<std::size_t>(sensor_height), 0.0F);
}

void DetectorState::set_aperture(double aperture_m) noexcept {
    const double pupil_m2 = std::numbers::pi / 4 * aperture_m * aperture_m;
    for (std::size_t b = 0; b < electrons_per_s.size(); ++b)
        electrons_per_s[b] =
            pupil_m2 * settings.transmission * settings.fill_factor * band_electrons_per_joule[b];
}

struct Detector::Impl {
    DetectorState state;
};

Detector::Detector(const SensorDescription& description, std::span<const SpectralBand> bands,
                   double aperture_m, std::uint64_t seed)
    : impl_(new Impl{DetectorState(description, bands, aperture_m, seed)}) {}

Detector::~Detector() = default;
Detector::Detector(Detector&&) noexcept = default;
Detector& Detector::operator=(Detector&&) noexcept = default;

std::uint32_t Detector::expose(const ReadoutPlan& plan, const IrradianceBand& light, std::uint64_t frame_id,
                               AnalogSettings analog, std::span<std::uint16_t> dn,
                               const ExposureTruth& truth) const noexcept {
    DetectorState& state = impl_->state;
    const auto width = static_cast<std::size_t>(plan.width);
    assert(light.first_row >= 0 && light.first_row + light.rows <= plan.height);
    assert(light.values.size() >= static_cast<std::size_t>(light.halo_above + light.rows + light.halo_below) *
                                      static_cast<std::size_t>(light.width) * state.electrons_per_s.size());
    assert(dn.size() >= static_cast<std::size_t>(light.rows) * width);
    if (light.rows <= 0) return 0;

    const ScratchPool::Lease scratch(state.scratch);
    BandExposure band(state, plan, light, frame_id, analog, *scratch);
    for (std::int32_t r = 0; r < light.rows; ++r) {
        const std::size_t at = static_cast<std::size_t>(r) * width;
        ExposureTruth row;
        if (!truth.mean_e.empty()) row.mean_e = truth.mean_e.subspan(at, width);
        if (!truth.saturated.empty()) row.saturated = truth.saturated.subspan(at, width);
        band.expose_row(light.first_row + r, dn.data() + at, row);
    }
    if (band.values_replaced() != 0)
        state.values_replaced.fetch_add(band.values_replaced(), std::memory_order_relaxed);
    return band.saturated_windows();
}

std::int32_t Detector::halo_rows() const noexcept {
    const DetectorSettings& s = impl_->state.settings;
    return (s.crosstalk_edge > 0 || s.crosstalk_corner > 0 ? 1 : 0) + (s.blooming > 0 ? 1 : 0);
}

bool Detector::needs_whole_columns() const noexcept {
    return impl_->state.settings.smear_row_ns > 0;
}

void Detector::forget() noexcept {
    std::fill(impl_->state.memory.begin(), impl_->state.memory.end(), 0.0F);
}

void Detector::begin_run(std::uint32_t run) noexcept {
    impl_->state.noise_key = run_key(impl_->state.seed, run);
    forget();
}

std::uint64_t Detector::lag_frames() const noexcept {
    constexpr double negligible_e = 1e-12;
    const DetectorSettings& s = impl_->state.settings;
    if (s.lag <= 0) return 0;
    if (s.lag >= 1) return std::numeric_limits<std::uint64_t>::max();
    return static_cast<std::uint64_t>(std::ceil(std::log(negligible_e / s.full_well_e) / std::log(s.lag)));
}

namespace {

template<class Visit>
void each_hit(const DetectorState& state, const ReadoutPlan& plan, std::uint64_t frame_id, Visit visit) {
    if (state.particles.none() || plan.rows.empty()) return;
    Time begin = plan.rows.front().reset, end = plan.rows.front().read;
    for (const RowTime& t : plan.rows) {
        begin = std::min(begin, t.reset);
        end = std::max(end, t.read);
    }
    state.particles.each(state.noise_key, frame_id, begin, end, 0, state.sensor_height, visit);
}

} // namespace

std::vector<ParticleHit> Detector::hits(const ReadoutPlan& plan, std::uint64_t frame_id) const {
    std::vector<ParticleHit> list;
    each_hit(impl_->state, plan, frame_id, [&](const ParticleHit& hit) { list.push_back(hit); });
    return list;
}

std::uint64_t Detector::list_hits(const ReadoutPlan& plan, std::uint64_t frame_id,
                                  std::vector<ParticleHit>& list) const noexcept {
    list.clear();
    std::uint64_t count = 0;
    each_hit(impl_->state, plan, frame_id, [&](const ParticleHit& hit) {
        if (list.size() < list.capacity()) list.push_back(hit);
        ++count;
    });
    return count;
}

const FixedPattern& Detector::fixed_pattern() const noexcept {
    return impl_->state.pattern;
}

std::uint64_t Detector::values_replaced() const noexcept {
    return impl_->state.values_replaced.load(std::memory_order_relaxed);
}

void Detector::set_aperture(double aperture_m) noexcept {
    impl_->state.set_aperture(aperture_m);
}

std::span<const double> Detector::electrons_per_s_per_w_m2() const noexcept {
    return impl_->state.electrons_per_s;
}

} // namespace obscura::sensors
