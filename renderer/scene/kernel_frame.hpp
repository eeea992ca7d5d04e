// SPDX-License-Identifier: Apache-2.0
// The inertial frame of a scene with SPICE kernels, and paths of bodies in it.
#pragma once

#include "core/geometry.hpp"
#include "ephemeris/kernels/ephemeris.hpp"
#include "ephemeris/time/epoch.hpp"
#include "renderer/scene/scene.hpp"

#include <memory>
#include <string>
#include <vector>

namespace obscura::scene {

/// Inertial frame with ICRF axes, at rest relative to the solar system barycentre, so that light is straight
/// in it; its origin is where a body, the centre, is at scene time 0, so that positions near it are precise.
/// Immutable, thread-safe.
class KernelFrame {
public:
    /// Throws InputError unless the kernels cover `centre` at the epoch.
    KernelFrame(ephemeris::Ephemeris kernels, ephemeris::Epoch epoch, int centre);

    [[nodiscard]] const ephemeris::Ephemeris& kernels() const { return kernels_; }
    /// The solar system barycentre, which is at rest in the frame.
    [[nodiscard]] Vec3 barycentre_m() const noexcept { return -1.0 * origin_m_; }
    /// Time of the kernels at a scene time, which counts SI seconds of TAI: right to a microsecond within
    /// days of the epoch. Real-time safe.
    [[nodiscard]] ephemeris::TdbTime tdb(double scene_s) const noexcept;
    /// Scene time at which the kernels are at `tdb_s`; infinite ones stay infinite.
    [[nodiscard]] double scene_s(double tdb_s) const noexcept;
    /// Sets `position_m` to that of a body at a scene time, without light time. Real-time safe.
    [[nodiscard]] ephemeris::Evaluation position(int body, double scene_s, Vec3& position_m) const noexcept;
    /// As above, with the velocity; within a part in 1e8 per second of the scene.
    [[nodiscard]] ephemeris::Evaluation state(int body, double scene_s,
                                              ephemeris::State& state) const noexcept;
    /// As position(); throws InputError with the covered intervals.
    [[nodiscard]] Vec3 position(int body, double scene_s) const;
    /// Scene times at which position() of a body is known.
    [[nodiscard]] std::vector<ephemeris::Interval> coverage(int body) const;

private:
    ephemeris::Ephemeris kernels_;
    ephemeris::TdbTime epoch_;
    int centre_;
    Vec3 origin_m_; ///< from the barycentre
};

/// Path of a body without rotation that moves as slowly as the Sun about the barycentre: within ten days of
/// scene time 0 from states half a day apart, right to 0.1 mm and fast. Otherwise as kernel_path() in J2000.
[[nodiscard]] std::shared_ptr<const PosePath> slow_kernel_path(std::shared_ptr<const KernelFrame> scene,
                                                               int body);

/// Path of something that moves as `local` in the frame at body `body` with the axes of `frame` ("J2000",
/// "IAU_EUROPA", that of a CK). Where the kernels cover neither, that frame is where it is at the nearest
/// covered time. Throws InputError if the frame is unknown, or one of them is not covered at scene time 0,
/// unless the attitude is known at instants only.
[[nodiscard]] std::shared_ptr<const PosePath> kernel_path(std::shared_ptr<const KernelFrame> scene, int body,
                                                          const std::string& frame, const Pose& local);
[[nodiscard]] std::shared_ptr<const PosePath> kernel_path(std::shared_ptr<const KernelFrame> scene, int body,
                                                          const std::string& frame,
                                                          std::shared_ptr<const PosePath> local);

} // namespace obscura::scene
