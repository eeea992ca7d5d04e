// The scene as plain data: what a scene file says and the renderer is built from.
#pragma once

#include "core/geometry.hpp"
#include "core/time.hpp"

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

namespace obscura::scene {

/// A pose at an instant of scene time. Scene time is seconds from the start of the scene; the emulator maps
/// the scheduling clock onto it.
struct TimedPose {
    double time_s = 0;
    Pose pose;
};

/// Where something is over time: a fixed pose, a table, or a uniform spin about an axis of the thing's own
/// frame. Between samples position is linear and attitude slerp; outside the table the end pose holds.
struct Motion {
    std::vector<TimedPose> samples{{}}; ///< at least one, strictly increasing in time
    Vec3 spin_axis{0, 0, 1};            ///< own frame
    double spin_rate_rad_s = 0;
};

struct Ellipsoid {
    Vec3 radii_m{1, 1, 1};
};
struct MeshFile {
    std::string path; ///< Wavefront OBJ
    double metres_per_unit = 1;
    bool smooth_normals = true;
};
/// A small body made from noise and craters; same seed, same body.
struct ProceduralBody {
    double mean_radius_m = 500;
    Vec3 axis_ratios{1, 0.8, 0.7};
    std::uint64_t seed = 1;
    std::uint32_t subdivisions = 6; ///< 20 * 4^n facets
};
using Shape = std::variant<Ellipsoid, MeshFile, ProceduralBody>;

struct Lambert {
    double albedo = 0.1; ///< hemispherical reflectance, 0..1
};
/// Lommel-Seeliger: r = w/(4 pi) mu0/(mu0+mu), `albedo` is the single-scattering albedo w.
struct LommelSeeliger {
    double albedo = 0.1;
};
using Material = std::variant<Lambert, LommelSeeliger>;

struct Body {
    std::string name;
    Shape shape;
    Material material;
    Motion motion;
};

struct Sun {
    Vec3 position_m{-149597870700.0, 0, 0}; ///< inertial
    double radius_m = 695'700'000.0;        ///< nominal solar radius, IAU 2015 B3
    double irradiance_scale = 1;            ///< times ASTM E490
};

/// Stars as an infinitely far catalogue.
struct Star {
    double right_ascension_rad = 0, declination_rad = 0; ///< J2000
    double magnitude_v = 0;
    double colour_b_v = 0;
};

/// A spectral band with a top-hat response.
struct SpectralBand {
    double from_m = 400e-9, to_m = 900e-9;
};

struct Camera {
    std::int32_t width = 1024, height = 1024; ///< the whole sensor
    double pixel_pitch_m = 18e-6;
    double focal_length_m = 0.05;
    double aperture_m = 0.025; ///< entrance pupil diameter
    double psf_sigma_px = 0.5; ///< Gaussian; 0 puts every star into one pixel
    Motion motion;
};

/// Everything that can be seen, and the camera that looks.
struct Scene {
    std::string name;
    Camera camera;
    Sun sun;
    std::vector<Body> bodies;
    std::vector<Star> stars;
    std::vector<SpectralBand> bands{SpectralBand{}};
};

} // namespace obscura::scene
