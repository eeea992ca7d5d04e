// SPDX-License-Identifier: Apache-2.0
// Reference frames of SPICE kernels as functions of time: fixed, rotation models of bodies, spacecraft
// attitude.
#pragma once

#include "core/geometry.hpp"
#include "ephemeris/kernels/daf.hpp"
#include "ephemeris/kernels/kernel_pool.hpp"
#include "ephemeris/segments/evaluation.hpp"
#include "ephemeris/segments/segment_data.hpp"
#include "ephemeris/time/epoch.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace obscura::ephemeris {

/// Orientation of a frame over time. Immutable, thread-safe.
class FrameModel {
public:
    virtual ~FrameModel() = default;
    /// Sets `to_icrf` to the rotation that takes vectors of the frame to ICRF axes. Real-time safe.
    [[nodiscard]] virtual Evaluation orientation(TdbTime time, Quat& to_icrf) const noexcept = 0;
};

/// Frame fixed in another one; null: in ICRF.
[[nodiscard]] std::shared_ptr<const FrameModel> make_fixed_frame(std::shared_ptr<const FrameModel> base,
                                                                 Quat to_base);

/// Rotation model of a body from a text PCK: pole, prime meridian, and periodic terms (IAU WGCCRE).
struct RotationModel {
    /// Terms of one angle: degrees, degrees per century (prime meridian: per day), and so on.
    std::vector<double> pole_ra, pole_dec, prime_meridian;
    /// Amplitudes of the sines (declination: cosines) of the phase angles, degrees.
    std::vector<double> periodic_ra, periodic_dec, periodic_meridian;
    std::vector<double> phases; ///< polynomials of `phase_terms` coefficients, degrees and centuries
    std::size_t phase_terms = 2;
    double epoch_s = 0; ///< TDB since J2000
};
/// The model of body `id`; empty: the pool has no pole for it. Throws InputError if the variables contradict
/// each other.
[[nodiscard]] std::optional<RotationModel> rotation_model(const KernelPool& pool, int id);
/// Rotation from body axes to the frame that the model refers to. Real-time safe.
[[nodiscard]] Quat orientation(const RotationModel& model, TdbTime time) noexcept;

/// Segment of a binary PCK, type 2: Euler angles as Chebyshev series.
class PckSegment {
public:
    /// Throws InputError for other types and damaged segments.
    explicit PckSegment(const Daf::Array& array);
    [[nodiscard]] std::int32_t frame_class() const { return class_; }
    /// Frame that the angles refer to: NAIF id, 1 is J2000.
    [[nodiscard]] std::int32_t base() const { return base_; }
    [[nodiscard]] Interval coverage() const { return {begin_s_, end_s_}; }
    [[nodiscard]] const std::string& place() const { return place_; }
    /// Rotation to the base frame, at a covered time. False: the data are damaged. Real-time safe.
    [[nodiscard]] bool orientation(TdbTime time, Quat& to_base) const noexcept;

private:
    std::string place_;
    std::int32_t class_ = 0, base_ = 0;
    double begin_s_ = 0, end_s_ = 0;
    ChebyshevRecords records_;
};

/// A segment and the frame that it refers to; null: ICRF.
struct BasedPckSegment {
    const PckSegment* segment;
    std::shared_ptr<const FrameModel> base;
};
/// Frame of a body: the segments that cover a time, the first that does, else the model. `segments` must
/// outlive it.
[[nodiscard]] std::shared_ptr<const FrameModel> make_body_frame(std::vector<BasedPckSegment> segments,
                                                                std::optional<RotationModel> model,
                                                                std::shared_ptr<const FrameModel> model_base);

/// Spacecraft clock, type 1: encoded ticks against TDB or TT (NAIF, SCLK Required Reading).
class SpacecraftClock {
public:
    /// Clock `id` (of spacecraft: negative, the spacecraft's own code). Throws InputError if the pool has
    /// none, or a type other than 1.
    SpacecraftClock(const KernelPool& pool, int id);

    /// Encoded ticks at `time`; NaN before the clock's first correlation. Real-time safe.
    [[nodiscard]] double ticks(TdbTime time) const noexcept;
    /// Inverse of ticks(), in one double.
    [[nodiscard]] double tdb_s(double ticks) const noexcept;

private:
    struct Correlation {
        double ticks, parallel_s, seconds_per_tick;
    };
    std::vector<Correlation> correlations_;
    bool tt_ = false; ///< parallel time is TT
};

class CkSegment;

/// CK segment and the frame that its attitudes are relative to; null: ICRF.
struct BasedCkSegment {
    const CkSegment* segment; ///< null: one that cannot be used holds `unusable_ticks`
    std::shared_ptr<const FrameModel> base;
    Interval unusable_ticks{};
};
/// Frame of a spacecraft or instrument: the first segment that covers a time. `segments` must outlive it.
[[nodiscard]] std::shared_ptr<const FrameModel> make_ck_frame(std::vector<BasedCkSegment> segments,
                                                              SpacecraftClock clock);

} // namespace obscura::ephemeris
