// SPDX-License-Identifier: Apache-2.0
// Ephemeris from SPICE kernels: states of bodies, orientations of frames, radii, coverage. Read this first.
#pragma once

#include "ephemeris/kernels/coverage.hpp"
#include "ephemeris/kernels/frame_model.hpp"
#include "ephemeris/kernels/kernel_pool.hpp"
#include "ephemeris/kernels/spk_segment.hpp"
#include "ephemeris/segments/evaluation.hpp"
#include "ephemeris/time/epoch.hpp"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::ephemeris {

/// NAIF number of the solar system barycenter.
inline constexpr int solar_system_barycenter = 0;

/// Loaded kernels: SPK, binary PCK (type 2), CK, text kernels (LSK, PCK, FK, SCLK) and meta-kernels. A kernel
/// is taken for what it offers: a segment that cannot be used is refused when it is asked for. Later files
/// have priority over earlier ones, later segments of a file over earlier ones, as in SPICE. Bodies are NAIF
/// codes, 0 is the solar system barycentre; axes are those of the ICRF, which SPICE calls J2000. Immutable
/// after construction, thread-safe; copies share the kernels.
class Ephemeris {
public:
    /// Loads kernels in order. Files of a meta-kernel that are not absolute are relative to its folder.
    /// Throws InputError, naming file and place.
    explicit Ephemeris(const std::vector<std::filesystem::path>& kernels);

    /// Code of a body by name or by the code as text. Throws InputError if the name is unknown.
    [[nodiscard]] int body(std::string_view name) const;
    [[nodiscard]] std::string body_name(int id) const;

    /// Sets `state` to the geometric state of `target` relative to `observer`: no light time, no aberration.
    /// Real-time safe.
    [[nodiscard]] Evaluation state(int target, int observer, TdbTime time, State& state) const noexcept;
    /// As above; throws InputError with the covered intervals.
    [[nodiscard]] State state(int target, int observer, TdbTime time) const;
    /// Why state() gave `status`, as one line.
    [[nodiscard]] std::string reason(int target, int observer, TdbTime time, Evaluation status) const;

    /// Frame by name ("J2000", "IAU_MARS", "MOON_PA_DE421", those of frame kernels). Keeps the kernels alive.
    /// Throws InputError if it is unknown, or of a class that is not supported.
    [[nodiscard]] std::shared_ptr<const FrameModel> frame(std::string_view name) const;
    /// Name of the body-fixed frame of a body: that of OBJECT_..._FRAME in a kernel, else IAU_ and its name.
    [[nodiscard]] std::string body_frame_name(int id) const;
    /// Rotation that takes vectors of `frame` to ICRF axes. Throws InputError.
    [[nodiscard]] Quat orientation(std::string_view frame, TdbTime time) const;

    /// Radii of the ellipsoid: equatorial towards the prime meridian, equatorial, polar. Empty: no kernel has
    /// them.
    [[nodiscard]] std::optional<Vec3> radii_m(int id) const;

    /// Bodies with radii, and those with a rotation model in a text PCK, ascending.
    [[nodiscard]] std::vector<int> bodies_with_radii() const;
    [[nodiscard]] std::vector<int> modelled_bodies() const;
    /// Bodies with states, ascending.
    [[nodiscard]] std::vector<int> bodies() const;
    /// Intervals over which a body has states relative to some centre.
    [[nodiscard]] std::vector<Interval> coverage(int id) const;
    /// Intervals over which state() of `target` relative to `observer` is known; of all times one infinite
    /// one.
    [[nodiscard]] std::vector<Interval> coverage(int target, int observer) const;
    /// Intervals over which the orientation of a frame is known. Throws InputError as frame() does.
    [[nodiscard]] std::vector<Interval> orientation_coverage(std::string_view frame) const;
    /// Frames with orientations in binary PCK and CK files, and the covered intervals.
    struct FrameCoverage {
        int id = 0;       ///< class id of the frame
        std::string name; ///< empty: no kernel names it
        std::vector<Interval> covered;
    };
    [[nodiscard]] std::vector<FrameCoverage> frame_coverage() const;

    /// What of the kernels cannot be used, one line each that names file and place.
    [[nodiscard]] const std::vector<std::string>& unusable() const;

    [[nodiscard]] const KernelPool& pool() const;

private:
    struct Impl;
    std::shared_ptr<const Impl> impl_;
};

} // namespace obscura::ephemeris
