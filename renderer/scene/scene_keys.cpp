// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene/scene_keys.hpp"

#include "core/units.hpp"
#include "renderer/scene/surface_place.hpp"

#include <utility>
#include <vector>

namespace obscura::scene {
namespace {

constexpr double nano = 1e-9, micro = 1e-6, milli = 1e-3;

/// Key of a flag that files write as one of two words.
config::Key word_key(std::string_view name, bool* value, std::string_view off, std::string_view on) {
    const auto set = [value, on](std::string_view word) { *value = word == on; };
    const auto get = [value, off, on] { return std::string(*value ? on : off); };
    return config::key(name, config::Word{set, get}).choices({off, on});
}

} // namespace

config::Keys keys_of(Scene& s) {
    return {
        config::key("name", &s.name).help("Name of the scene; the file's own name if not given"),
        config::key("max_bounces", &s.max_bounces)
            .range(0, 1000)
            .help("Largest number of reflections after the first; "
                  "0: direct light only, 1: also what other bodies reflect to a body (planetshine)"),
        config::key("light_time", &s.light_time)
            .help("Correct for light time: show points of bodies where they were when their light left them"),
        config::key("aberration", &s.aberration)
            .help("Apply stellar aberration: directions are those seen from the moving camera"),
        config::key("light_deflection", &s.light_deflection)
            .help("Bend the light of stars and bodies by the Sun's gravity; bodies shift as a whole"),
        config::key("quantity", &s.quantity)
            .help("What pixels hold: irradiance at the entrance pupil, W/m2, or radiance, W m-2 sr-1"),
    };
}

config::Keys keys_of(Sun& s) {
    return {
        config::key("position_m", &s.position_m)
            .unit("m")
            .range(anywhere)
            .help("Centre of the Sun, inertial; direction and distance_au can be given instead"),
        config::key("radius_m", &s.radius_m).unit("m").range(1, 1e12).help("Radius of the Sun's disc"),
        config::key("limb_darkening", &s.limb_darkening)
            .range(0, 1)
            .help(
                "Limb darkening u of the Sun's disc, linear law 1 - u (1 - mu), about 0.6 for visible light; 0: a uniform disc"),
        config::key("irradiance_scale", &s.irradiance_scale)
            .range(0, 1e6)
            .help("Factor on the Sun's ASTM E490 spectrum; 0: no Sun"),
    };
}

config::Keys keys_of(Camera& s) {
    return {
        config::key("width", &s.width)
            .unit("px")
            .range(1, 65536)
            .help("Columns of the sensor; a daemon takes its own sensor's"),
        config::key("height", &s.height)
            .unit("px")
            .range(1, 65536)
            .help("Rows of the sensor; a daemon takes its own sensor's"),
        config::key("pixel_pitch_um", config::Scaled{&s.pixel_pitch_m, micro})
            .unit("um")
            .range(0.1, 1000)
            .help("Pitch of the pixels; a daemon takes its own sensor's"),
        config::key("pixel_pitch_y_um", config::Scaled{&s.pixel_pitch_y_m, micro})
            .unit("um")
            .range(0, 1000)
            .help("Pitch of the rows where pixels are not square; 0: pixel_pitch_um"),
        config::key("focal_length_mm", config::Scaled{&s.focal_length_m, milli})
            .unit("mm")
            .range(0.1, 1e6)
            .help("Focal length of the optics"),
        config::key("aperture_mm", config::Scaled{&s.aperture_m, milli})
            .unit("mm")
            .range(0.001, 1e5)
            .help("Diameter of the entrance pupil"),
        config::key("psf_sigma_px", &s.psf_sigma_px)
            .unit("px")
            .range(0, 20)
            .help("Standard deviation of the Gaussian point spread function; 0: each star in one pixel"),
        config::key("velocity_m_s", &s.velocity_m_s)
            .unit("m/s")
            .range(-2.9e8, 2.9e8)
            .help(
                "Velocity of the camera in the inertial frame, for aberration; that of the trajectory if not given"),
        config::key("psf", &s.psf.model)
            .or_table()
            .help(
                "Point spread function: gaussian (psf_sigma_px), airy (diffraction at the aperture), table (psf_file), or one of your own: psf = { model = \"FILE.psf\", PARAMETER = VALUE }, see models.md"),
        config::key("psf_obscuration", &s.psf.obscuration)
            .range(0, 0.99)
            .help("Diameter of the central obscuration over that of the aperture"),
        config::key("psf_defocus_um", config::Scaled{&s.psf.defocus_m, micro})
            .unit("um")
            .range(-1e5, 1e5)
            .help("Distance of the focus from the sensor, with psf gaussian and airy"),
        config::key("psf_file", config::Path{&s.psf.file})
            .help(
                "FITS images of a point source, with psf table; keywords OVERSAMP (samples per pixel), FIELDX, FIELDY, BAND"),
        config::key("psf_core_px", &s.psf.core_px)
            .unit("px")
            .range(2, 128)
            .help(
                "Radius of the core of the point spread function, within which camera samples are displaced; "
                "with psf airy, table and models and with defocus"),
        config::key("psf_wings_px", &s.psf.wings_px)
            .unit("px")
            .range(0, 65536)
            .help(
                "Radius of the wings of the point spread function, beyond psf_core_px; 0: no wings, all light is in the core"),
        config::key("projection", &s.projection)
            .or_table()
            .help(
                "Distance from the centre at the angle t to the boresight: f tan t, f t, 2 f sin t/2, 2 f tan t/2, f sin t; "
                "or a SuMoL model of your own: { model = \"FILE.prj\", PARAMETER = VALUE }"),
        config::key("distortion", &s.distortion.model)
            .help("Model of the lens distortion; each has coefficients of its own or a table"),
        config::key("distortion_coefficients", &s.distortion.coefficients)
            .range(-1e6, 1e6)
            .help("Coefficients of the distortion, those left out are 0; "
                  "brown-conrady (real to ideal): k1 k2 k3 p1 p2; "
                  "opencv: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4; radial: k1 k2 k3 k4"),
        config::key("distortion_ideal_mm", &s.distortion.ideal_mm)
            .unit("mm")
            .range(0, 1e6)
            .help("Distortion table: distances from the centre that the projection gives, from 0 up"),
        config::key("distortion_real_mm", &s.distortion.real_mm)
            .unit("mm")
            .range(0, 1e6)
            .help("Distortion table: real distances from the centre of the same points"),
        config::key("principal_offset_px",
                    config::Numbers{s.principal_offset_px.data(), s.principal_offset_px.size()})
            .unit("px")
            .range(-65536, 65536)
            .help(
                "Principal point, where the optical axis meets the sensor, from the sensor's centre: right, down"),
        config::key("sensor_rotation_deg", config::Scaled{&s.sensor_rotation_rad, degree})
            .unit("deg")
            .range(-360, 360)
            .help("Rotation of the sensor about the optical axis, right towards down"),
        word_key("vignetting", &s.pupil_cosine, "none", "cos4")
            .help("cos4: light is attenuated by the cosine of its angle to the boresight; "
                  "with the solid angle of a pinhole's pixels this is the cos^4 law"),
    };
}

config::Keys keys_of(Body& s) {
    return {
        config::key("name", &s.name).help("Name of the body; body0, body1, ... if not given"),
        config::key("colour", &s.colour)
            .range(0, 100)
            .help("Factor on the body's reflectance in each spectral band; empty: 1"),
        config::key("emission_w_m2_sr", &s.emission_w_m2_sr)
            .unit("W m-2 sr-1")
            .range(0, 1e15)
            .help("Radiance that the body's outer side emits in each spectral band; empty: none"),
        config::key("emission_spectrum", config::Curve{&s.emission_spectrum})
            .range(0, 1e30)
            .help("Relative spectrum of the emission: [nm, value] pairs, increasing in wavelength; "
                  "the detector's efficiency is weighted by it; empty: like sunlight"),
        config::key("emission_texture", config::Path{&s.textures.emission, true, true})
            .or_table()
            .help(
                "Emission map, a factor on emission_w_m2_sr: an image or model as for albedo_texture; empty: none"),
        config::key("albedo_texture", config::Path{&s.textures.albedo, true, true})
            .or_table()
            .help(
                "Albedo map, a factor on the body's reflectance: "
                "FITS, PNG, TIFF, JPEG, OpenEXR or PDS3 image; or { model = \"FILE.txr\", tex = \"IMAGE\" }; "
                "empty: none"),
        config::key("normal_texture", config::Path{&s.textures.normal, true, true})
            .help("Normal map, an image that perturbs the surface normals; empty: none"),
        word_key("texture_coding", &s.textures.srgb, "linear", "srgb")
            .help(
                "Coding of the texels of albedo_texture and emission_texture: linear or sRGB (IEC 61966-2-1)"),
        word_key("texture_mapping", &s.textures.by_longitude, "own", "longitude")
            .help(
                "Texture coordinates: own: those of the shape where it has any; longitude: longitude and latitude"),
        config::key("texture_left_deg", config::Scaled{&s.textures.left_longitude_rad, degree})
            .unit("deg")
            .range(-360, 360)
            .help(
                "Longitude of the left edge of a texture that is mapped by longitude; a file that says its own place is there"),
    };
}

config::Keys keys_of(Lamp& s) {
    return {
        config::key("name", &s.name).help("Name of the lamp; lamp0, lamp1, ... if not given"),
        config::key("beam", &s.beam).help("Shape of the lamp's beam about the +z axis of its own frame"),
        config::key("half_angle_deg", config::Scaled{&s.half_angle_rad, degree})
            .unit("deg")
            .range(0.001, 180)
            .help(
                "Half angle of the beam; uniform: its edge; gaussian: where exp(-2) of the axial intensity is left"),
        config::key("intensity_w_sr", &s.intensity_w_sr)
            .unit("W/sr")
            .range(0, 1e20)
            .required()
            .help("Radiant intensity of the lamp on the axis of its beam, in each spectral band"),
        config::key("spectrum", config::Curve{&s.spectrum})
            .range(0, 1e30)
            .help("Relative spectrum of the lamp: [nm, value] pairs, increasing in wavelength; "
                  "the detector's efficiency is weighted by it; empty: like sunlight"),
    };
}

config::Keys keys_of(models::Global& s) {
    return {
        config::key("name", &s.name).required().help("Name of the global in the texts of models"),
        config::key("values", &s.values)
            .range(-1e15, 1e15)
            .required()
            .help("Its value: a number for each component, or one for all"),
    };
}

config::Keys keys_of(Landmark& s) {
    return {
        config::key("name", &s.name)
            .required()
            .help("Name of the landmark in the truth table, at most 31 bytes"),
        config::key("body", &s.body).required().help("Name of the body that it is on"),
        config::key("longitude_deg", config::Scaled{&s.longitude_rad, degree})
            .unit("deg")
            .range(longitudes_deg)
            .help("Longitude of the point about the body's z axis, from its x axis towards its y axis; "
                  "the point is where that direction from the origin leaves the surface"),
        config::key("latitude_deg", config::Scaled{&s.latitude_rad, degree})
            .unit("deg")
            .range(latitudes_deg)
            .help(
                "Latitude of the point: angle between its direction from the body's origin and the body's xy plane (planetocentric)"),
        word_key("latitudes", &s.planetographic, name_of(Latitudes::planetocentric),
                 name_of(Latitudes::planetographic))
            .help(
                "Meaning of latitude_deg: planetocentric, or planetographic: the angle between the normal of the body's reference ellipsoid and its xy plane (geodetic)"),
    };
}

config::Keys keys_of(StrayLight& s) {
    return {
        config::key("file", config::Path{&s.file})
            .required()
            .help(
                "Map of the stray light, FITS or OpenEXR of the sensor's size: one plane, or one for each spectral band"),
        config::key("w_m2_per_unit", &s.w_m2_per_unit)
            .unit("W/m2")
            .range(0, 1e12)
            .help("Irradiance that a value of 1 in the stray light map adds to a pixel"),
        config::key("follows_sun", &s.follows_sun)
            .help("Scale the stray light map by the Sun's irradiance at the camera over that at 1 au"),
    };
}

config::Keys keys_of(SpectralBand& s) {
    return {
        config::key("from_nm", config::Scaled{&s.from_m, nano})
            .unit("nm")
            .range(100, 20000)
            .required()
            .help("Lower end of the spectral band"),
        config::key("to_nm", config::Scaled{&s.to_m, nano})
            .unit("nm")
            .range(100, 20000)
            .required()
            .help("Upper end of the spectral band"),
        config::key("transmission", config::Curve{&s.transmission})
            .range(0, 1)
            .help(
                "Transmission of filter and optics over wavelength: [nm, fraction] pairs, increasing in wavelength; "
                "1 if not given"),
    };
}

} // namespace obscura::scene
