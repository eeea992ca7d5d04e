// SPDX-License-Identifier: Apache-2.0
// Row times of a frame and the poses at them: finds the row on which a moving object lands.
#pragma once

#include "core/camera/frame.hpp"
#include "renderer/camera/aberration.hpp"
#include "renderer/camera/gaussian_psf.hpp"
#include "renderer/camera/projection.hpp"
#include "renderer/camera/psf.hpp"
#include "renderer/lights/star_field.hpp"
#include "renderer/lights/star_spectra.hpp"
#include "renderer/pixel_times.hpp"
#include "renderer/truth/function_ref.hpp"
#include "renderer/world/row_state.hpp"
#include "renderer/world/sky_sources.hpp"

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <optional>
#include <span>
#include <vector>

namespace obscura::renderer {

class BodyLight;

/// Renderer's own description of a scene, for the truth table. Does not own anything; outlives what uses it.
struct TruthScene {
    const scene::Scene& scene;
    const std::vector<BuiltBody>& bodies;
    const Projection& lens; ///< of the camera at rest
    const GaussianPsf& gaussian_psf;
    const Psf* psf;                    ///< null: the Gaussian
    std::span<const Vec3> landmarks_m; ///< body frame, in the order of the scene
    const FieldStars& stars;           ///< that may be in the field
    const SkySources& sky;
    std::span<const double> sun_w_m2; ///< per band, at 1 au
    /// Weights of star_band_weights_um() for W/m2, of bands without their response; empty: none has one.
    std::span<const StarBins> star_energy_um;
    std::uint32_t max_instants;
    double reach_px;  ///< of the PSF
    double field_rad; ///< largest angle of a pixel to the boresight
    /// Version of the tiles of each body that is a terrain: see DetailView::version.
    std::span<const std::uint64_t> tile_versions;
    bool wait_for_tiles = true; ///< see DetailView::wait
    BodyLight* light = nullptr; ///< null: the light of bodies is unknown
    /// Poses that the frame was made with at the scene time `poses_s`. Where a simulator has moved the scene
    /// on since, all instants are shifted by what differs then. Null: those that the scene has now.
    const GroundTruth* poses = nullptr;
    double poses_s = 0;
};

/// Poses at one instant.
struct TruthState {
    double time_s = 0;
    Pose camera;
    Mat3 camera_from_inertial;
    Vec3 beta;  ///< camera velocity over the speed of light, camera axes
    Vec3 sun_m; ///< centre of the Sun, inertial
    std::span<ApparentBody> bodies;

    /// Origin of camera rays in the frame of a body.
    [[nodiscard]] Vec3 eye_m(std::size_t body) const { return bodies[body].eye_m(camera.position_m); }
    /// Centre of the Sun in the frame of a body.
    [[nodiscard]] Vec3 sun_from_m(std::size_t body) const {
        return rotate(conjugate(bodies[body].pose.orientation), bodies[body].to_sun_m(sun_m));
    }
};

/// Where the light of an object lands in a window.
struct Landing {
    ImagePoint at;           ///< in the composed image
    ImagePoint psf_shift;    ///< part of `at`
    RowTime row;             ///< of the row on which it lands
    double row_position = 0; ///< that row in the composed image
    double inside = 0;       ///< share of the exposure in which it lands in the window
    double seen = 0;         ///< share of the exposure in which it also is not hidden
    double seconds = 0; ///< of exposure to its light in all rows, weighted by the transmission of the lens
    ImagePoint streak;  ///< from its first to its last position
    const TruthState* state{}; ///< at the middle of the exposure
};

/// The exposure of each row is divided into a few instants, as the renderer divides it. At an instant the
/// row times make a function of the row; the object lands where its image at the time of a row is on that
/// row. Between rows all is linear. Under a rolling shutter that moves with an image the object lights more
/// rows than one at rest. Thread-bound; allocates only beyond its workspace.
class RowStates {
public:
    /// Towards an object, at rest, camera axes, any length; and whether it is seen in that direction.
    using Direction = FunctionRef<Vec3(const TruthState&)>;
    using Seen = FunctionRef<bool(const TruthState&, Vec3)>;
    /// The same at several instants together: the answers go to the last argument.
    using AllSeen =
        FunctionRef<void(std::span<const TruthState* const>, std::span<const Vec3>, std::span<bool>)>;

    /// `rows`: of the composed image, scene time; `row_times`: the same by the clock of the landings.
    /// Push-broom: every row is the first row of its window. `pixel_times`: of each window; empty: pixels
    /// have the times of their rows.
    RowStates(const TruthScene& scene, std::span<const FrameWindow> windows, std::span<const RowTime> rows,
              std::span<const RowTime> row_times, bool push_broom, std::span<const PixelTimes> pixel_times,
              std::span<std::byte> workspace);
    RowStates(const RowStates&) = delete;
    RowStates& operator=(const RowStates&) = delete;

    [[nodiscard]] std::span<const FrameWindow> windows() const { return windows_; }
    [[nodiscard]] const TruthScene& scene() const { return scene_; }
    [[nodiscard]] std::uint32_t instants() const { return instants_; }
    /// The instants that the renderer takes.
    [[nodiscard]] std::uint32_t rendered_instants() const { return rendered_instants_; }
    /// State at an instant of a row of the composed image.
    [[nodiscard]] const TruthState& at(std::int32_t row, std::uint32_t instant);
    /// State of the middle row of a window.
    [[nodiscard]] const TruthState& middle_of(std::size_t window);
    /// Lasts as long as this object.
    [[nodiscard]] const TruthState& state_at(double time_s);
    /// Memory for what lasts as long as this object.
    [[nodiscard]] std::pmr::memory_resource& memory() { return memory_; }
    /// Whether an image point of the sensor is on the pixels of a window.
    [[nodiscard]] bool on_window(std::size_t window, ImagePoint at) const;
    /// Image point on the sensor of a direction at rest (camera axes), with the centroid of the PSF, whose
    /// part in it is `shift`.
    [[nodiscard]] std::optional<ImagePoint> project(const TruthState& state, Vec3 direction,
                                                    ImagePoint& shift) const;
    [[nodiscard]] double transmission(const TruthState& state, Vec3 direction) const;

    /// Landing of an object in a window; empty: nowhere near it. The centroid is over the
    /// instants at which it is seen inside the window; if there are none, over those inside; if there are
    /// none either, over all.
    [[nodiscard]] std::optional<Landing> land(std::size_t window, Direction direction, Seen seen);
    [[nodiscard]] std::optional<Landing> land_together(std::size_t window, Direction direction, AllSeen seen);
    /// Signal of the next objects in each spectral band, for the centroid of the PSF.
    void set_band_weights(std::span<const double> weights) { band_weights_ = weights; }

private:
    struct Crossing {
        ImagePoint at, shift; ///< in the composed image
        double seconds = 0;
        std::int32_t row = 0;
        double between = 0;
        bool inside = false;
        const TruthState* state = nullptr;
    };
    [[nodiscard]] std::optional<Crossing> cross(std::size_t window, std::uint32_t instant,
                                                Direction direction);
    /// The same of a window whose pixels have times of their own: where the image of the object is at the
    /// time of the pixel there. Times between pixels are linear.
    [[nodiscard]] std::optional<Crossing> cross_pixels(std::size_t window, std::uint32_t instant,
                                                       Direction direction);
    /// Times at an image point of the sensor, scene time.
    [[nodiscard]] RowTime pixel_time(std::size_t window, ImagePoint at) const;
    [[nodiscard]] TruthState& new_state();
    void set_state(TruthState& s, double time_s) const;
    /// From a pose that the scene has now to that of the frame.
    struct Change {
        Quat turn;
        Vec3 shift_m;
        [[nodiscard]] Pose of(const Pose& pose) const {
            return {pose.position_m + shift_m, turn * pose.orientation};
        }
    };
    void find_changes();
    /// Row of the sensor that a row of the composed image shows.
    [[nodiscard]] double sensor_row(std::size_t window, double row) const {
        const FrameWindow& w = windows_[window];
        return push_broom_ ? w.sensor.y : w.sensor.y + (row - w.image_y);
    }

    const TruthScene& scene_;
    std::pmr::monotonic_buffer_resource memory_;
    std::span<const FrameWindow> windows_;
    std::span<const RowTime> rows_, row_times_;
    bool push_broom_;
    std::span<const PixelTimes> pixel_times_;
    TruthState* tried_ = nullptr; ///< by cross_pixels()
    std::uint32_t instants_ = 1, rendered_instants_ = 1;
    std::span<const double> band_weights_;
    Change camera_change_;
    std::pmr::vector<Change> body_changes_;      ///< empty: the scene has not moved on
    std::pmr::vector<std::size_t> first_state_;  ///< of each row: the index of its first state
    std::pmr::vector<const TruthState*> states_; ///< null: not yet asked for
};

} // namespace obscura::renderer
