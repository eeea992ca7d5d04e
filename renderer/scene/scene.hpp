// SPDX-License-Identifier: Apache-2.0
// Scene description as plain data: bodies, light sources, stars and the camera of a scene file.
#pragma once

#include "core/camera/intrinsics.hpp"
#include "core/geometry.hpp"
#include "core/spectral_band.hpp"
#include "core/text/enum_names.hpp"
#include "core/time.hpp"
#include "ephemeris/time/epoch.hpp"
#include "models/kinds/motion_program.hpp"
#include "renderer/scene/description.hpp"
#include "renderer/scene/model_texture.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace obscura::ephemeris {
class StarFile;
}

namespace obscura::models {
class TimingProgram;
}

namespace obscura::scene {

/// Pose at an instant of scene time: seconds from the start of the scene, onto which the emulator maps the
/// scheduling clock. The pose is relative to the inertial frame, or to the parent body; its quaternion turns
/// vectors of the moving frame into that frame.
struct TimedPose {
    double time_s = 0; ///< scene time
    Pose pose;
};

/// Source of poses that are received while the program runs. Thread-safe, real-time safe.
class LivePose {
public:
    virtual ~LivePose() = default;
    /// Sets `pose` to the pose at `time_s`, with a unit quaternion; false: none is known yet.
    [[nodiscard]] virtual bool at(double time_s, Pose& pose) const noexcept = 0;
    /// Age of what at() gives for `time_s`: time by which it is later than the newest pose known; 0: between
    /// poses, or none is known.
    [[nodiscard]] virtual double age_s(double /*time_s*/) const noexcept { return 0; }
};

/// Distances of a scene time from those for which positions and attitudes are known, s; 0 within them.
struct PoseAges {
    double position_s = 0, attitude_s = 0;

    [[nodiscard]] double largest_s() const { return position_s > attitude_s ? position_s : attitude_s; }
};

/// Path of a motion: poses from a file that states how to interpolate them, as a function of scene time
/// alone. Thread-safe, real-time safe.
class PosePath {
public:
    virtual ~PosePath() = default;
    /// Pose at `time_s`, any finite number, with a unit quaternion.
    [[nodiscard]] virtual Pose at(double time_s) const noexcept = 0;
    /// Derivative of the position of at(), m/s: 0 where the path holds; at a corner that of what follows, at
    /// the end that of what came before.
    [[nodiscard]] virtual Vec3 velocity_m_s(double time_s) const noexcept = 0;
    /// Ages of what at() gives for `time_s`.
    [[nodiscard]] virtual PoseAges ages(double time_s) const noexcept = 0;
    /// The larger of them.
    [[nodiscard]] double age_s(double time_s) const noexcept { return ages(time_s).largest_s(); }
    /// Times at which the file has poses, ascending; not real-time safe.
    [[nodiscard]] virtual std::vector<double> times_s() const = 0;
    /// Times of an attitude that is known at instants only, ascending; empty: it is known in between, or
    /// constant. Not real-time safe.
    [[nodiscard]] virtual std::vector<double> attitude_instants_s() const { return {}; }
};

/// Aim of the z axis of the camera or a lamp, held at every instant. The camera is aimed at the direction in
/// which it sees the body: with Scene::light_time and Scene::aberration the apparent one.
struct Aim {
    /// Name of the body that has the target, or sun_name; empty: none. In a file also that of a landmark.
    std::string body{};
    Vec3 point_m{}; ///< target, in the frame of that body (not of the Sun), without one in that of the motion
    /// Direction that is up in the image (-y), in the frame of the motion, any length above 0. Where the view
    /// is parallel to it within 1e-6 rad, the x axis of that frame takes its place, or the y axis if the view
    /// is parallel to x.
    Vec3 up{0, -1, 0};
    bool own_axes = false; ///< `up` is in the axes of the attitude that the aim replaces, not of the motion
};
/// Name of the Sun as the target of an aim, unless a body has that name.
inline constexpr const char* sun_name = "sun";

struct SurfaceTrack; // renderer/scene/surface_place.hpp

/// Motion of a body, a lamp or the camera: a fixed pose, a trajectory, a path, or one of them with a uniform
/// spin about an axis of the moving frame. Between samples position is linear and attitude slerp; outside the
/// table the end pose holds.
struct Motion {
    std::vector<TimedPose> samples{{}}; ///< at least one, strictly increasing in time
    Vec3 spin_axis{0, 0, 1};            ///< moving frame, any length above 0
    double spin_rate_rad_s = 0;
    /// Aim of the camera or a lamp: replaces the attitudes above. Not together with a hinge or a slide.
    std::optional<Aim> aim{};
    /// Instead of `samples`; null: none.
    std::shared_ptr<const PosePath> path{};
    /// Axes of a message's poses and, of positions, the body they count from, as it names them; empty: none.
    std::string message_frame{}, message_centre{};
    /// Overrides all of the above once it has a pose; null: none.
    std::shared_ptr<const LivePose> live{};
    /// The frame of the poses is at the origin of the parent, but has inertial axes.
    bool inertial_axes = false;
    /// Places on the parent that are yet to be turned into positions
    /// (renderer/scene_files/surface_places.hpp); null in scenes that were read.
    std::shared_ptr<const SurfaceTrack> on_surface{};
};

/// Family of shapes: renderer/registries/registry.hpp lists the kinds, each with a struct of its parameters.
struct ShapeFamily;
/// Shape of a body: kind and parameter values, lengths in metres in the body frame.
using Shape = Description<ShapeFamily>;

/// Family of materials: renderer/materials/registry.hpp lists the kinds, each with a struct of its
/// parameters.
struct MaterialFamily;
/// Material of a body: scattering law and parameter values, angles in radians.
using Material = Description<MaterialFamily>;

/// Texture files of a body. Where the shape has no texture coordinates of its own, a map covers the whole
/// body by longitude and latitude, or what its file's georeference says.
struct Textures {
    std::string albedo;                             ///< albedo map, a factor on the reflectance; empty: none
    std::string normal;                             ///< normal map; empty: none
    bool srgb = false;                              ///< albedo and emission map are coded as sRGB, not linear
    bool by_longitude = false;                      ///< also where the shape has texture coordinates
    double left_longitude_rad = -3.141592653589793; ///< longitude of the image's left edge
    /// Parameter map: a parameter of the material from an image of one plane, in SI units.
    struct Parameter {
        std::string name; ///< the material's key without its unit
        std::string file;
        /// Values for a texel of 0 and a texel of 1 (integers: full scale).
        double at_zero = 0, at_one = 1;
        std::shared_ptr<const ModelTexture> model{}; ///< in place of a file; null: none
    };
    std::vector<Parameter> parameters{};
    std::string emission{}; ///< emission map, a factor on Body::emission_w_m2_sr; empty: none
    /// Textures that users have written, in place of files; null: none.
    std::shared_ptr<const ModelTexture> albedo_model{}, emission_model{};

    [[nodiscard]] bool has_albedo() const { return !albedo.empty() || albedo_model; }
    [[nodiscard]] bool has_emission() const { return !emission.empty() || emission_model; }
};

/// Joint between a body, a lamp or the camera and its parent, of one degree of freedom or none.
struct Joint {
    /// Degree of freedom.
    enum class Kind : std::uint8_t {
        fixed, ///< none
        hinge, ///< rotation about `axis`
        slide, ///< translation along `axis`
    };
    /// Joint value at an instant.
    struct Sample {
        double time_s = 0; ///< scene time
        double value = 0;  ///< hinge: angle, rad; slide: offset, m
    };
    Kind kind = Kind::fixed;
    Vec3 axis{0, 0, 1};            ///< moving frame, any length above 0
    std::vector<Sample> samples{}; ///< times increase; linear between, ends held; empty: 0
};
constexpr auto enum_names(Joint::Kind /*type*/) {
    using Kind = Joint::Kind;
    return std::array{EnumName{Kind::fixed, "fixed"}, EnumName{Kind::hinge, "hinge"},
                      EnumName{Kind::slide, "slide"}};
}

/// Body: shape, material and motion. Body frame: right-handed, metres, origin and axes as the shape defines
/// them.
struct Body {
    std::string name; ///< unique in the scene
    Shape shape;
    Material material;
    Motion motion;
    /// Factor on the material's reflectance in each spectral band, 0 .. 1 / albedo; empty: 1 in all.
    std::vector<double> colour{};
    /// The reflectance over wavelength of which `colour` are the means over sunlight; empty: not known.
    std::vector<SpectralPoint> colour_curve{};
    /// `colour` of W/m2 where the bands have a response, by which it is weighted; empty: `colour`.
    std::vector<double> colour_of_energy{};
    /// Radiance that the outer side emits, W m-2 sr-1 in each spectral band, for thermal emission too; empty:
    /// none.
    std::vector<double> emission_w_m2_sr{};
    /// Relative spectrum of it, per wavelength; empty: like sunlight.
    std::vector<SpectralPoint> emission_spectrum{};
    Textures textures{};
    /// Parent: name of the body in whose frame `motion` is; empty: the inertial frame. A live pose is
    /// relative to the parent too; a hinge uses only its rotation about the joint's axis, a slide only its
    /// translation along it.
    std::string parent{};
    Joint joint{};
    std::string preset{}; ///< name of the preset that `material` is from; empty: none
    /// "file:line:column" of its table in the scene file, for messages; empty: made by a program.
    std::string position{};
};

/// Lamp of negligible size: a point source, or a beam about the +z axis of its own frame. It illuminates
/// bodies, but is not visible itself.
struct Lamp {
    /// Angular distribution of the intensity.
    enum class Beam : std::uint8_t {
        point,    ///< isotropic
        uniform,  ///< constant within `half_angle_rad` of the axis
        gaussian, ///< exp(-2 (angle / half_angle_rad)^2)
    };
    std::string name;
    Motion motion;
    Beam beam = Beam::point;
    double half_angle_rad = 0.17453292519943295; ///< 10 degrees
    std::vector<double> intensity_w_sr;          ///< on the axis, in each spectral band
    std::vector<SpectralPoint> spectrum{};       ///< of it, relative, per wavelength; empty: like sunlight
    std::string parent{};                        ///< see Body::parent
    Joint joint{};
    std::string position{}; ///< see Body::position
};
constexpr auto enum_names(Lamp::Beam /*type*/) {
    using Beam = Lamp::Beam;
    return std::array{EnumName{Beam::point, "point"}, EnumName{Beam::uniform, "uniform"},
                      EnumName{Beam::gaussian, "gaussian"}};
}

/// The Sun: a sphere with the ASTM E490 spectrum.
struct Sun {
    Vec3 position_m{-149597870700.0, 0, 0}; ///< centre, inertial frame
    double radius_m = 695'700'000.0;        ///< nominal solar radius, IAU 2015 B3
    double irradiance_scale = 1;            ///< factor on the spectrum; 0: no Sun
    /// Limb darkening u of the linear law I(mu) = I(1) (1 - u (1 - mu)); 0: a uniform disc. The irradiance
    /// does not depend on it.
    double limb_darkening = 0;
    /// Instead of `position_m`, which is its place at scene time 0; null: the Sun stays.
    std::shared_ptr<const PosePath> path{};

    /// Centre at a scene time, inertial frame.
    [[nodiscard]] Vec3 position_at(double time_s) const {
        return path ? path->at(time_s).position_m : position_m;
    }
};

/// Spectral type of a star.
struct SpectralType {
    /// Luminosity class.
    enum class Luminosity : std::uint8_t {
        unknown,
        dwarf,      ///< IV and V
        giant,      ///< II and III
        supergiant, ///< I
    };
    /// O, B, A, F, G, K, M are 0 to 6, the subclass is a tenth: G2 is 4.2; NaN: only the luminosity class is
    /// known.
    double number = 0;
    Luminosity luminosity = Luminosity::unknown;
};

/// Spectral distribution of a star's light.
enum class StarSpectrum : std::uint8_t {
    measured,   ///< of its spectral class
    black_body, ///< of its colour temperature
};
constexpr auto enum_names(StarSpectrum /*type*/) {
    return std::array{EnumName{StarSpectrum::measured, "template"},
                      EnumName{StarSpectrum::black_body, "black-body"}};
}

/// Star at infinite distance: J2000 direction, Johnson V and B-V magnitudes.
struct Star {
    double right_ascension_rad = 0, declination_rad = 0; ///< J2000 equator and equinox
    double magnitude_v = 0;
    std::optional<double> colour_b_v{}; ///< none: that of the spectral type
    std::optional<SpectralType> type{}; ///< none: by the colour; neither: as the Sun
    StarSpectrum spectrum = StarSpectrum::measured;
};

/// Stars of a catalogue file (ephemeris/stars/star_file.hpp).
struct StarCatalogue {
    std::shared_ptr<const ephemeris::StarFile> file{}; ///< null: none
    double limiting_v = 20;                            ///< fainter stars are left out
    StarSpectrum spectrum = StarSpectrum::measured;
};

struct SkyObject; // renderer/scene/sky_object.hpp

/// Projection: image distance from the centre over the focal length, for a direction at the angle t to the
/// boresight.
enum class Projection : std::uint8_t {
    pinhole,       ///< tan t
    equidistant,   ///< t
    equisolid,     ///< 2 sin(t/2)
    stereographic, ///< 2 tan(t/2)
    orthographic,  ///< sin t
    model,         ///< Camera::own_projection, with its distortion
};
constexpr auto enum_names(Projection /*type*/) {
    return std::array{EnumName{Projection::pinhole, "pinhole"},
                      EnumName{Projection::equidistant, "equidistant"},
                      EnumName{Projection::equisolid, "equisolid"},
                      EnumName{Projection::stereographic, "stereographic"},
                      EnumName{Projection::orthographic, "orthographic"},
                      EnumName{Projection::model, "model"}};
}

/// Lens distortion: deviation of the real image points from the ideal projection. Lengths are over the focal
/// length; r is the distance from the centre, x to the right, y down.
struct Distortion {
    /// Formula or table.
    enum class Model : std::uint8_t {
        none,
        /// From real to ideal: x + x (k1 r^2 + k2 r^4 + k3 r^6) + p1 (r^2 + 2 x^2) + 2 p2 x y, and likewise
        /// y. Coefficients k1, k2, k3, p1, p2; Brown, Close-range camera calibration (1971).
        brown_conrady,
        /// From ideal to real, as OpenCV's calib3d: k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4.
        opencv,
        /// From ideal to real: r (1 + k1 r^2 + k2 r^4 + k3 r^6 + k4 r^8); OpenCV's fisheye model, together
        /// with the equidistant projection.
        radial,
        table, ///< real distance from the centre by ideal distance, monotone cubic between entries
    };
    Model model = Model::none;
    std::vector<double> coefficients;      ///< those left out are 0
    std::vector<double> ideal_mm, real_mm; ///< table: distances from the centre, in the focal plane
};
constexpr auto enum_names(Distortion::Model /*type*/) {
    using Model = Distortion::Model;
    return std::array{EnumName{Model::none, "none"}, EnumName{Model::brown_conrady, "brown-conrady"},
                      EnumName{Model::opencv, "opencv"}, EnumName{Model::radial, "radial"},
                      EnumName{Model::table, "table"}};
}

/// Point spread function of the optics, before integration over pixels.
struct PointSpread {
    /// Source of the function.
    enum class Model : std::uint8_t {
        gaussian, ///< sigma: Camera::psf_sigma_px
        airy,     ///< diffraction at the aperture, over the wavelengths of each band
        table,    ///< images from a file, by field position and spectral band
        model,    ///< density() of `own`
    };
    Model model = Model::gaussian;
    double obscuration = 0;    ///< central obscuration: diameter over the aperture's
    double defocus_m = 0;      ///< distance of the focus from the sensor; not for tables
    std::string file{};        ///< FITS, see renderer/camera/psf_file.hpp
    models::ModelValues own{}; ///< a model of kind psf
    /// Core radius, within which camera samples are displaced; light beyond it is in the wings.
    double core_px = 16;
    double wings_px = 0; ///< wing radius; 0: no wings, all light is in the core
};
constexpr auto enum_names(PointSpread::Model /*type*/) {
    using Model = PointSpread::Model;
    return std::array{EnumName{Model::gaussian, "gaussian"}, EnumName{Model::airy, "airy"},
                      EnumName{Model::table, "table"}, EnumName{Model::model, "model"}};
}

/// Named point of a body, for the truth table.
struct Landmark {
    std::string name;
    std::string body{};               ///< name of the body
    std::optional<Vec3> position_m{}; ///< body frame; none: the surface at longitude and latitude
    /// Direction from the body's origin: longitude from its x axis, east positive; latitude from its xy
    /// plane.
    double longitude_rad = 0, latitude_rad = 0;
    std::string position{};      ///< see Body::position
    bool planetographic = false; ///< the latitude is that of the normal of the body's reference ellipsoid
};

/// Camera: sensor, optics and motion. Camera frame: right-handed, x right, y down, z boresight.
struct Camera {
    std::int32_t width = 1024, height = 1024; ///< of the whole sensor, px
    double pixel_pitch_m = 18e-6;             ///< of the columns
    double pixel_pitch_y_m = 0;               ///< of the rows; 0: pixel_pitch_m, square pixels
    double focal_length_m = 0.05;
    double aperture_m = 0.025; ///< entrance pupil diameter
    /// Gaussian PSF; 0: each star in one pixel. Lengths of the PSF are in pitches of the columns: what is
    /// round on the focal plane is an ellipse in rectangular pixels.
    double psf_sigma_px = 0.5;
    PointSpread psf{};
    Motion motion;
    std::string parent{}; ///< see Body::parent
    Joint joint{};
    /// Small motion on top of the pose; null: none.
    std::shared_ptr<const models::MotionProgram> vibration{};
    /// Times of rows or pixels where no sensor has them; null: all pixels are exposed together.
    std::shared_ptr<const models::TimingProgram> timing{};
    /// Inertial velocity for Scene::aberration; zero: that of `motion`.
    Vec3 velocity_m_s{};
    Projection projection = Projection::pinhole;
    models::ModelValues own_projection{}; ///< a model of kind projection
    Distortion distortion{};
    /// Principal point from the centre of the sensor: right, down.
    std::array<double, 2> principal_offset_px{0, 0};
    double sensor_rotation_rad = 0; ///< about the optical axis, x towards y
    /// Vignetting of a flat pupil: light is attenuated by the cosine of its angle to the boresight. Together
    /// with the solid angle of a pinhole's pixels, which falls with the cube, this is the cos^4 law.
    bool pupil_cosine = false;
    std::string position{}; ///< see Body::position

    [[nodiscard]] double row_pitch_m() const { return pixel_pitch_y_m > 0 ? pixel_pitch_y_m : pixel_pitch_m; }
    /// Pitch of the rows over that of the columns; exactly 1 for square pixels.
    [[nodiscard]] double pixel_aspect() const { return row_pitch_m() / pixel_pitch_m; }
    /// The shorter pitch over the longer one; exactly 1 for square pixels.
    [[nodiscard]] double pixel_flattening() const {
        return pixel_aspect() > 1 ? 1 / pixel_aspect() : pixel_aspect();
    }
    [[nodiscard]] Intrinsics intrinsics() const {
        return {{focal_length_m / pixel_pitch_m, focal_length_m / row_pitch_m()},
                {(width - 1) / 2.0 + principal_offset_px[0], (height - 1) / 2.0 + principal_offset_px[1]},
                {pixel_pitch_m, row_pitch_m()}};
    }
};

/// Stray light map: ghosts and reflections of the optics, added to the image.
struct StrayLight {
    std::string file;         ///< FITS or OpenEXR of the sensor's size, one plane or one for each band
    double w_m2_per_unit = 1; ///< irradiance that a value of 1 adds to a pixel
    bool follows_sun = false; ///< scaled by the Sun's irradiance at the camera over that at 1 au
    std::string position{};   ///< see Body::position
};

/// Quantity in the pixels of a frame.
enum class Quantity : std::uint8_t {
    irradiance, ///< at the entrance pupil from the pixel's solid angle, W/m2: input of a detector
    radiance,   ///< irradiance over the pixel's solid angle, W m-2 sr-1: for comparison with other programs
};
constexpr auto enum_names(Quantity /*type*/) {
    return std::array{EnumName{Quantity::irradiance, "irradiance"}, EnumName{Quantity::radiance, "radiance"}};
}

/// Largest number of spectral bands of a scene.
constexpr std::size_t max_bands = 16;

class KernelFrame;

/// Name of the camera where bodies and lamps have theirs: no other thing may have it.
inline constexpr std::string_view camera_name = "camera";

/// Scene: bodies, light sources, stars and the camera. Inertial frame: right-handed, metres, J2000 axes.
struct Scene {
    std::string name;
    /// Instant of scene time 0; scene time counts SI seconds of TAI from it. None: the scene has no date.
    std::optional<ephemeris::Epoch> epoch{};
    Camera camera;
    Sun sun;
    std::vector<Body> bodies;
    std::vector<Star> stars;
    StarCatalogue catalogue{};                                   ///< more stars
    std::shared_ptr<const std::vector<SkyObject>> sky_objects{}; ///< null: none
    std::vector<Lamp> lamps{};
    std::vector<SpectralBand> bands{SpectralBand{}};
    std::vector<StrayLight> stray_light{};
    std::vector<Landmark> landmarks{};
    std::vector<models::Global> globals{}; ///< of the models that users have written
    /// Light-time correction: points of bodies are seen where they were when their light left them, also
    /// from one body to another (renderer/world/light_time.hpp).
    bool light_time = false;
    bool aberration = false; ///< stellar aberration by the camera's velocity
    /// Light from stars and bodies is bent by the Sun's gravity. Bodies are shifted as a whole, as the light
    /// of their centres is.
    bool light_deflection = false;
    std::uint32_t max_bounces = 0; ///< largest number of reflections after the first
    Quantity quantity = Quantity::irradiance;
    /// Place of the inertial frame among the bodies of SPICE kernels (renderer/scene/kernel_frame.hpp); null:
    /// the scene has no kernels.
    std::shared_ptr<const KernelFrame> kernels{};
};

} // namespace obscura::scene
