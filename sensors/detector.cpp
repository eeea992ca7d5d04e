#include "core/error.hpp"
#include "sensors/band_exposure.hpp"
#include "sensors/dark_current.hpp"
#include "sensors/photometry.hpp"
#include "sensors/streams.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <string_view>

namespace obscura::sensors {

std::string explain_invalid(const DetectorSettings& s) {
    struct Limit {
        std::string_view key;
        double value, least, most;
    };
    const Limit limits[] = {
        {"transmission", s.transmission, 0, 1},
        {"fill_factor", s.fill_factor, 0, 1},
        {"prnu_local", s.prnu_local, 0, 1},
        {"prnu_global", s.prnu_global, 0, 1},
        {"crosstalk_edge", s.crosstalk_edge, 0, 0.2},
        {"crosstalk_corner", s.crosstalk_corner, 0, 0.05},
        {"parasitic_light", s.parasitic_light, 0, 1},
        {"smear_row_ns", static_cast<double>(s.smear_row_ns), 0, 1e9},
        {"optical_black_rows", static_cast<double>(s.optical_black_rows), 0, 65536},
        {"electrical_black_rows", static_cast<double>(s.electrical_black_rows), 0, 65536},
        {"temperature_c", s.temperature_c, -200, 150},
        {"dark_reference_c", s.dark_reference_c, -200, 150},
        {"dark_doubling_k", s.dark_doubling_k, 0.1, 1000},
        {"dark_current_e_per_s", s.dark_current_e_per_s, 0, 1e9},
        {"dark_nonuniformity_e_per_s", s.dark_nonuniformity_e_per_s, 0, 1e9},
        {"hot_fraction", s.hot_fraction, 0, 1},
        {"hot_current_e_per_s", s.hot_current_e_per_s, 0, 1e9},
        {"rts_fraction", s.rts_fraction, 0, 1},
        {"rts_current_e_per_s", s.rts_current_e_per_s, 0, 1e9},
        {"hit_flux_per_cm2_s", s.hit_flux_per_cm2_s, 0, 1e6},
        {"hit_depth_m", s.hit_depth_m, 1e-7, 1e-3},
        {"hit_charge_e_per_m", s.hit_charge_e_per_m, 0, 1e12},
        {"full_well_e", s.full_well_e, 1, 1e7},
        {"blooming", s.blooming, 0, 1},
        {"nonlinearity[0]", s.nonlinearity[0], -1, 1},
        {"nonlinearity[1]", s.nonlinearity[1], -1, 1},
        {"nonlinearity[2]", s.nonlinearity[2], -1, 1},
        {"nonlinearity[3]", s.nonlinearity[3], -1, 1},
        {"lag", s.lag, 0, 1},
        {"read_noise_e", s.read_noise_e, 0, 1e5},
        {"conversion_gain_v_per_e", s.conversion_gain_v_per_e, 0, 1e-2},
        {"offset_fpn_e", s.offset_fpn_e, 0, 1e5},
        {"column_fpn_e", s.column_fpn_e, 0, 1e5},
        {"row_noise_e", s.row_noise_e, 0, 1e5},
        {"follower_rts_fraction", s.follower_rts_fraction, 0, 1},
        {"follower_rts_e", s.follower_rts_e, 0, 1e5},
        {"gain_dn_per_e", s.gain_dn_per_e, 1e-6, 1e6},
        {"offset_dn", s.offset_dn, 0, 65535},
        {"adc_bits", static_cast<double>(s.adc_bits), 8, 16},
        {"adc_inl_dn", s.adc_inl_dn, 0, 1000},
        {"adc_dnl_dn", s.adc_dnl_dn, 0, 100},
        {"dead_fraction", s.dead_fraction, 0, 1},
        {"stuck_fraction", s.stuck_fraction, 0, 1},
        {"dead_rows", static_cast<double>(s.dead_rows), 0, 65536},
        {"dead_columns", static_cast<double>(s.dead_columns), 0, 65536},
    };
    for (const Limit& l : limits)
        if (!(l.value >= l.least && l.value <= l.most)) // NaN fails both
            return fmt::format("{}: {}, {} to {} is allowed", l.key, l.value, l.least, l.most);
    if (s.quantum_efficiency.empty()) return "quantum_efficiency: empty, at least one point is needed";
    for (std::size_t i = 0; i < s.quantum_efficiency.size(); ++i) {
        const SpectralPoint& p = s.quantum_efficiency[i];
        if (!(p.value >= 0 && p.value <= 1))
            return fmt::format("quantum_efficiency: {}, 0 to 1 is allowed", p.value);
        if (!(p.wavelength_m > 0) || (i > 0 && !(p.wavelength_m > s.quantum_efficiency[i - 1].wavelength_m)))
            return fmt::format("quantum_efficiency: wavelength {} m: above 0 and rising is allowed",
                               p.wavelength_m);
    }
    return {};
}

namespace {

const SensorDescription& checked(const SensorDescription& d, double aperture_m) {
    std::string why = explain_invalid(d.detector);
    if (why.empty() && !(aperture_m >= 0 && aperture_m <= 1e3))
        why = fmt::format("aperture_m: {}, 0 to 1000 is allowed", aperture_m);
    if (why.empty() &&
        (d.readout.width < 1 || d.readout.height < 1 || d.readout.width > 65536 || d.readout.height > 65536))
        why =
            fmt::format("width x height: {} x {}, 1 to 65536 is allowed", d.readout.width, d.readout.height);
    if (why.empty() && !(d.pixel_pitch_m > 1e-8 && d.pixel_pitch_m < 0.1))
        why = fmt::format("pixel_pitch_m: {}, 1e-8 to 0.1 is allowed", d.pixel_pitch_m);
    if (!why.empty()) throw ConfigError(fmt::format("sensor {}: {}", d.name, why));
    return d;
}

} // namespace

DetectorState::DetectorState(const SensorDescription& d, std::span<const SpectralBand> bands,
                             double aperture_m, std::uint64_t noise_seed)
    : settings(checked(d, aperture_m).detector),
      sensor_width(d.readout.width),
      sensor_height(d.readout.height),
      global_shutter(d.readout.shutter == Shutter::global),
      seed(noise_seed ^ temporal_key),
      pattern(d),
      particles(d, seed),
      adc(d),
      scratch(static_cast<std::size_t>(d.readout.width)),
      reset_sample_ns(d.readout.reset_instant_ns - d.readout.sample_instant_ns),
      dark_ratio(dark_current_ratio(settings, settings.temperature_c, settings.dark_reference_c)),
      reset_e(reset_noise_e(settings)) {
    const double pupil_m2 = std::numbers::pi / 4 * aperture_m * aperture_m;
    for (const SpectralBand& band : bands)
        electrons_per_s.push_back(pupil_m2 * settings.transmission * settings.fill_factor *
                                  electrons_per_joule(settings.quantum_efficiency, band));
    if (settings.lag > 0)
        memory.assign(static_cast<std::size_t>(sensor_width) * static_cast<std::size_t>(sensor_height), 0.0F);
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

namespace {

template<class Visit>
void each_hit(const DetectorState& state, const ReadoutPlan& plan, std::uint64_t frame_id, Visit visit) {
    if (state.particles.none() || plan.rows.empty()) return;
    Time begin = plan.rows.front().reset, end = plan.rows.front().read;
    for (const RowTime& t : plan.rows) {
        begin = std::min(begin, t.reset);
        end = std::max(end, t.read);
    }
    state.particles.each(frame_id, begin, end, 0, state.sensor_height, visit);
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

std::span<const double> Detector::electrons_per_s_per_w_m2() const noexcept {
    return impl_->state.electrons_per_s;
}

} // namespace obscura::sensors
