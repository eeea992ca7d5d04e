// SPDX-License-Identifier: Apache-2.0
// The scene as plain data: what a scene file says and the renderer is built from.
#pragma once

#include "core/enum_names.hpp"
#include "core/geometry.hpp"
#include "core/spectral_band.hpp"
#include "core/time.hpp"
#include "renderer/scene/description.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace obscura::scene {

/// A pose at an instant of scene time. Scene time is seconds from the start of the scene; the emulator maps
/// the scheduling clock onto it.
struct TimedPose {
    double time_s = 0;
    Pose pose;
};

/// Poses that come from outside while the program runs.
class LivePose {
public:
    virtual ~LivePose() = default;
    /// The pose at `time_s`, with a unit quaternion; false when none is known yet. Any thread; neither
    /// allocates nor locks.
    [[nodiscard]] virtual bool at(double time_s, Pose& pose) const noexcept = 0;
};

/// Where something is over time: a fixed pose, a table, or a uniform spin about an axis of the thing's own
/// frame. Between samples position is linear and attitude slerp; outside the table the end pose holds.
struct Motion {
    std::vector<TimedPose> samples{{}}; ///< at least one, strictly increasing in time
    Vec3 spin_axis{0, 0, 1};            ///< own frame
    double spin_rate_rad_s = 0;
    std::shared_ptr<const LivePose> live{}; ///< if any, instead of all that as soon as it knows
};

/// The kinds of shape are listed in renderer/shapes/registry.hpp, each with a struct of its parameters.
struct ShapeFamily;
using Shape = Description<ShapeFamily>;

/// The kinds of material are listed in renderer/materials/registry.hpp, each with a struct of its parameters.
struct MaterialFamily;
using Material = Description<MaterialFamily>;

/// Images on a body. A map covers the whole body by longitude and latitude where the shape has no texture
/// coordinates of its own.
struct Textures {
    std::string albedo;        ///< image file: factor on the material's reflectance; empty: none
    std::string normal;        ///< image file: normal map; empty: none
    bool srgb = false;         ///< the albedo image is coded for display
    bool by_longitude = false; ///< even where the shape has coordinates
    double left_longitude_rad = -3.141592653589793; ///< of the image's left edge
    /// A parameter of the scattering law from an image of one plane, in the parameter's SI unit.
    struct Parameter {
        std::string name; ///< of the material's key, without the unit
        std::string file;
        double at_zero = 0, at_one = 1; ///< what a texel of 0 and one of 1 (integers: full scale) stand for
    };
    std::vector<Parameter> parameters{};
};

/// How a body hangs on its parent.
struct Joint {
    enum class Kind : std::uint8_t {
        fixed,
        hinge, ///< turns about `axis`
        slide, ///< moves along `axis`
    };
    struct Sample {
        double time_s = 0;
        double value = 0; ///< angle, rad, or offset, m
    };
    Kind kind = Kind::fixed;
    Vec3 axis{0, 0, 1};            ///< the body's own frame
    std::vector<Sample> samples{}; ///< increasing in time, linear between, ends held; empty: 0
};
constexpr auto enum_names(Joint::Kind /*type*/) {
    using Kind = Joint::Kind;
    return std::array{EnumName{Kind::fixed, "fixed"}, EnumName{Kind::hinge, "hinge"},
                      EnumName{Kind::slide, "slide"}};
}

struct Body {
    std::string name;
    Shape shape;
    Material material;
    Motion motion;
    /// Factor on the material's reflectance in each spectral band, 0..1 / the law's albedo; empty: 1 in all.
    std::vector<double> colour{};
    /// Radiance that the outer side sends out by itself, W m-2 sr-1 in each band; empty: none. For thermal
    /// emission as well.
    std::vector<double> emission_w_m2_sr{};
    Textures textures{};
    /// Name of the body in whose frame `motion` is; empty: the inertial frame. A live pose is relative to the
    /// parent too, and of it a hinge takes the turn about its axis alone, a slide the way along it.
    std::string parent{};
    Joint joint{};
};

/// A small lamp: a point, or a beam about the +z axis of its own frame. It lights, but is not itself seen.
struct Lamp {
    enum class Beam : std::uint8_t {
        point,    ///< the same in all directions
        uniform,  ///< within `half_angle_rad` of the axis, nothing outside
        gaussian, ///< exp(-2 (angle / half_angle)^2)
    };
    std::string name;
    Motion motion;
    Beam beam = Beam::point;
    double half_angle_rad = 0.17453292519943295; ///< 10 degrees
    std::vector<double> intensity_w_sr;          ///< on the axis, in each band
    std::string parent{};                        ///< as of a body
    Joint joint{};
};
constexpr auto enum_names(Lamp::Beam /*type*/) {
    using Beam = Lamp::Beam;
    return std::array{EnumName{Beam::point, "point"}, EnumName{Beam::uniform, "uniform"},
                      EnumName{Beam::gaussian, "gaussian"}};
}

struct Sun {
    Vec3 position_m{-149597870700.0, 0, 0}; ///< inertial
    double radius_m = 695'700'000.0;        ///< nominal solar radius, IAU 2015 B3
    double irradiance_scale = 1;            ///< times ASTM E490
    /// u of the linear law I(mu) = I(1) (1 - u (1 - mu)); 0: a uniform disc. The irradiance is the same.
    double limb_darkening = 0;
};

/// Stars as an infinitely far catalogue.
struct Star {
    double right_ascension_rad = 0, declination_rad = 0; ///< J2000
    double magnitude_v = 0;
    double colour_b_v = 0;
};

/// How far from the centre, over the focal length, a direction at the angle t to the boresight is seen.
enum class Projection : std::uint8_t {
    pinhole,       ///< tan t
    equidistant,   ///< t
    equisolid,     ///< 2 sin(t/2)
    stereographic, ///< 2 tan(t/2)
    orthographic,  ///< sin t: a hemisphere seen from far outside
};
constexpr auto enum_names(Projection /*type*/) {
    return std::array{
        EnumName{Projection::pinhole, "pinhole"}, EnumName{Projection::equidistant, "equidistant"},
        EnumName{Projection::equisolid, "equisolid"}, EnumName{Projection::stereographic, "stereographic"},
        EnumName{Projection::orthographic, "orthographic"}};
}

/// How the real image departs from the ideal projection. All lengths are over the focal length, r is the
/// distance from the centre, x to the right, y down.
struct Distortion {
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
        table, ///< distances from the centre, monotone between the entries
    };
    Model model = Model::none;
    std::vector<double> coefficients; ///< those not given are 0
    std::vector<double> ideal_mm, real_mm;
};
constexpr auto enum_names(Distortion::Model /*type*/) {
    using Model = Distortion::Model;
    return std::array{EnumName{Model::none, "none"}, EnumName{Model::brown_conrady, "brown-conrady"},
                      EnumName{Model::opencv, "opencv"}, EnumName{Model::radial, "radial"},
                      EnumName{Model::table, "table"}};
}

/// How the light of a point spreads over the sensor, before pixels integrate it.
struct PointSpread {
    enum class Model : std::uint8_t {
        gaussian, ///< of Camera::psf_sigma_px
        airy,     ///< diffraction at the aperture, at the wavelengths of each band
        table,    ///< images from a file, by place in the field and by band
    };
    Model model = Model::gaussian;
    double obscuration = 0; ///< diameter of the central obscuration over the aperture's
    double defocus_m = 0;   ///< focus to sensor, along the axis; not for tables
    std::string file{};     ///< FITS, see renderer/camera/psf_file.hpp
    /// Camera samples are spread within this radius; light beyond it goes into the wings.
    double core_px = 16;
    double wings_px = 0; ///< how far wings are followed; 0: no wings, and all light is in the core
};
constexpr auto enum_names(PointSpread::Model /*type*/) {
    using Model = PointSpread::Model;
    return std::array{EnumName{Model::gaussian, "gaussian"}, EnumName{Model::airy, "airy"},
                      EnumName{Model::table, "table"}};
}

struct Camera {
    std::int32_t width = 1024, height = 1024; ///< the whole sensor
    double pixel_pitch_m = 18e-6;
    double focal_length_m = 0.05;
    double aperture_m = 0.025; ///< entrance pupil diameter
    double psf_sigma_px = 0.5; ///< Gaussian; 0 puts every star into one pixel
    PointSpread psf{};
    Motion motion;
    std::string parent{}; ///< as of a body
    Joint joint{};
    /// With Scene::aberration: if not zero, instead of the motion's own velocity.
    Vec3 velocity_m_s{};
    Projection projection = Projection::pinhole;
    Distortion distortion{};
    /// Where the optical axis meets the sensor, from its centre.
    std::array<double, 2> principal_offset_px{0, 0};
    double sensor_rotation_rad = 0; ///< of the sensor about the optical axis, x towards y
    /// Light is weakened by the cosine of its angle to the boresight, as a flat pupil does. Together with the
    /// solid angle of a pinhole's pixels, which falls with the cube, this is the cos^4 law.
    bool pupil_cosine = false;
};

/// Light that the optics put where it does not belong: ghosts, reflections in the housing.
struct StrayLight {
    std::string file; ///< FITS or OpenEXR of the sensor's size, one plane or one for each band
    double w_m2_per_unit = 1;
    bool follows_sun = false; ///< times the Sun's irradiance at the camera over that at 1 au
};

/// What the pixels of a frame hold.
enum class Quantity : std::uint8_t {
    irradiance, ///< at the entrance pupil from the pixel's solid angle, W/m2: what a detector needs
    radiance,   ///< the same over the pixel's solid angle, W m-2 sr-1: for comparing with other programs
};
constexpr auto enum_names(Quantity /*type*/) {
    return std::array{EnumName{Quantity::irradiance, "irradiance"}, EnumName{Quantity::radiance, "radiance"}};
}

constexpr std::size_t most_bands = 16;

/// Everything that can be seen, and the camera that looks.
struct Scene {
    std::string name;
    Camera camera;
    Sun sun;
    std::vector<Body> bodies;
    std::vector<Star> stars;
    std::vector<Lamp> lamps{};
    std::vector<SpectralBand> bands{SpectralBand{}};
    std::vector<StrayLight> stray_light{};
    /// Bodies are seen where they were when the light left them. (Not between bodies: shadows and light of
    /// one on another are those of the places where the camera sees them.)
    bool light_time = false;
    bool aberration = false;       ///< directions as seen from the moving camera
    std::uint32_t max_bounces = 0; ///< reflections after the first that light is followed over
    Quantity quantity = Quantity::irradiance;
};

} // namespace obscura::scene
