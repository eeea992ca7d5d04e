#include "renderer/scene/scene_keys.hpp"

#include "renderer/scene/kinds.hpp"

namespace obscura::scene {
namespace {

constexpr double nano = 1e-9, micro = 1e-6, milli = 1e-3;
/// 1e15 m is far beyond any planet and still a comfortable double.
constexpr config::Range anywhere{-1e15, 1e15};
constexpr double degree = 3.141592653589793 / 180;

/// A key whose words stand for values.
template<typename T>
config::Key word_key(std::string_view name, T* value,
                     const std::vector<std::pair<std::string_view, T>>& words, std::string_view help) {
    std::vector<std::string_view> choices;
    for (const auto& [word, meaning] : words)
        choices.push_back(word);
    const auto set = [value, words](std::string_view text) {
        for (const auto& [word, meaning] : words)
            if (word == text) *value = meaning;
    };
    const auto get = [value, words] {
        for (const auto& [word, meaning] : words)
            if (meaning == *value) return std::string(word);
        return std::string();
    };
    return config::key(name, config::Word{set, get}).choices(std::move(choices)).help(help);
}

} // namespace

config::Keys keys_of(scene::Scene& s) {
    const auto set = [&s](std::string_view word) {
        s.quantity = word == "radiance" ? scene::Quantity::radiance : scene::Quantity::irradiance;
    };
    const auto get = [&s] {
        return std::string(s.quantity == scene::Quantity::radiance ? "radiance" : "irradiance");
    };
    return {
        config::key("name", &s.name).help("Name of the scene; the file's own name if not given"),
        config::key("max_bounces", &s.max_bounces)
            .range(0, 1000)
            .help("Reflections after the first that light is followed over; 0: direct light only"),
        config::key("light_time", &s.light_time)
            .help("Bodies are seen where they were when the light left them"),
        config::key("aberration", &s.aberration).help("Directions are those seen from the moving camera"),
        config::key("quantity", config::Word{set, get})
            .choices({"irradiance", "radiance"})
            .help("What pixels hold: W/m2 at the pupil, or W m-2 sr-1"),
    };
}

config::Keys keys_of(SunKeys& s) {
    return {
        config::key("position_m", &s.position_m).unit("m").range(anywhere).help("Centre of the Sun"),
        config::key("direction", &s.direction)
            .range(anywhere)
            .help("Instead: direction from the origin to the Sun"),
        config::key("distance_au", &s.distance_au)
            .unit("au")
            .range(0.005, 1000)
            .help("Distance that goes with direction"),
        config::key("radius_m", &s.radius_m).unit("m").range(1, 1e12).help("Radius of the Sun's disc"),
        config::key("limb_darkening", &s.limb_darkening)
            .range(0, 1)
            .help("u of the linear law 1 - u (1 - mu), about 0.6 for visible light; 0: a uniform disc"),
        config::key("irradiance_scale", &s.irradiance_scale)
            .range(0, 1e6)
            .help("Times the ASTM E490 spectrum"),
    };
}

config::Keys keys_of(StarKeys& s) {
    return {
        config::key("catalogue", config::Path{&s.catalogue})
            .help("CSV table: ra_deg,dec_deg,v_mag,b_v (J2000)"),
        config::key("limiting_magnitude", &s.limiting_magnitude)
            .unit("mag")
            .range(-30, 40)
            .help("Fainter stars are left out"),
    };
}

config::Keys keys_of(scene::Camera& s) {
    using Model = scene::Distortion::Model;
    return {
        config::key("width", &s.width).unit("px").range(1, 65536).help("Columns; in a daemon the sensor's"),
        config::key("height", &s.height).unit("px").range(1, 65536).help("Rows; in a daemon the sensor's"),
        config::key("pixel_pitch_um", config::Scaled{&s.pixel_pitch_m, micro})
            .unit("um")
            .range(0.1, 1000)
            .help("In a daemon the sensor's"),
        config::key("focal_length_mm", config::Scaled{&s.focal_length_m, milli})
            .unit("mm")
            .range(0.1, 1e6)
            .help("Focal length"),
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
            .help("For aberration: velocity in the inertial frame; that of the trajectory if not given"),
        word_key("psf", &s.psf.model,
                 {{"gaussian", scene::PointSpread::Model::gaussian},
                  {"airy", scene::PointSpread::Model::airy},
                  {"table", scene::PointSpread::Model::table}},
                 "Point spread function: gaussian (psf_sigma_px), airy (diffraction at the aperture), table"),
        config::key("psf_obscuration", &s.psf.obscuration)
            .range(0, 0.99)
            .help("Diameter of the central obscuration over that of the aperture"),
        config::key("psf_defocus_um", config::Scaled{&s.psf.defocus_m, micro})
            .unit("um")
            .range(-1e5, 1e5)
            .help("Distance of the focus from the sensor, with gaussian and airy"),
        config::key("psf_file", config::Path{&s.psf.file})
            .help("Table: FITS images of a point; OVERSAMP samples a pixel, FIELDX, FIELDY, BAND"),
        config::key("psf_core_px", &s.psf.core_px)
            .unit("px")
            .range(2, 128)
            .help("Radius within which camera samples are spread, with airy, table or defocus"),
        config::key("psf_wings_px", &s.psf.wings_px)
            .unit("px")
            .range(0, 65536)
            .help("How far the light beyond the core is followed; 0: all is put into the core"),
        word_key("projection", &s.projection,
                 {{"pinhole", scene::Projection::pinhole},
                  {"equidistant", scene::Projection::equidistant},
                  {"equisolid", scene::Projection::equisolid},
                  {"stereographic", scene::Projection::stereographic},
                  {"orthographic", scene::Projection::orthographic}},
                 "Distance from the centre at the angle t to the boresight: f tan t, f t, 2 f sin t/2, "
                 "2 f tan t/2, f sin t"),
        word_key("distortion", &s.distortion.model,
                 {{"none", Model::none},
                  {"brown-conrady", Model::brown_conrady},
                  {"opencv", Model::opencv},
                  {"radial", Model::radial},
                  {"table", Model::table}},
                 "Departure from the projection; each has its own coefficients or table"),
        config::key("distortion_coefficients", &s.distortion.coefficients)
            .range(-1e6, 1e6)
            .help("brown-conrady (real to ideal): k1 k2 k3 p1 p2; opencv: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 "
                  "s4; radial: k1 k2 k3 k4"),
        config::key("distortion_ideal_mm", &s.distortion.ideal_mm)
            .unit("mm")
            .range(0, 1e6)
            .help("Table: distances from the centre that the projection gives, from 0 up"),
        config::key("distortion_real_mm", &s.distortion.real_mm)
            .unit("mm")
            .range(0, 1e6)
            .help("Table: where the lens really forms them"),
        config::key("principal_offset_px",
                    config::Numbers{s.principal_offset_px.data(), s.principal_offset_px.size()})
            .unit("px")
            .range(-65536, 65536)
            .help("Where the optical axis meets the sensor, from its centre: right, down"),
        config::key("sensor_rotation_deg", config::Scaled{&s.sensor_rotation_rad, degree})
            .unit("deg")
            .range(-360, 360)
            .help("Rotation of the sensor about the optical axis, right towards down"),
        word_key(
            "vignetting", &s.pupil_cosine, {{"none", false}, {"cos4", true}},
            "cos4: light weakened by the cosine of its angle to the boresight, with the solid angle of a "
            "pinhole's pixels the cos^4 law"),
    };
}

config::Keys camera_place_keys(PlaceKeys& s) {
    return {
        config::key("position_m", &s.position_m).unit("m").range(anywhere).help("Position"),
        config::key("orientation", &s.orientation)
            .range(-1.001, 1.001)
            .help("Quaternion [w, x, y, z] from camera axes (x right, y down, z boresight) to inertial"),
        config::key("boresight", &s.boresight).range(anywhere).help("Instead: direction of view"),
        config::key("look_at_m", &s.look_at_m).unit("m").range(anywhere).help("Instead: point in view"),
        config::key("up", &s.up)
            .range(anywhere)
            .help("Direction that is up in the image, with boresight or look_at_m"),
        config::key("trajectory", config::Path{&s.trajectory})
            .help("Instead: CSV table time_s,x_m,y_m,z_m,qw,qx,qy,qz"),
    };
}

config::Keys keys_of(BodyKeys& s) {
    return {
        config::key("name", &s.name).help("Name; body0, body1, ... if not given"),
        config::key("shape", &s.shape)
            .choices(names_of(shape_kinds()))
            .help("Kind of shape; its own keys stand beside"),
        config::key("material", &s.material)
            .choices(names_of(material_kinds()))
            .help("Photometric model; likewise"),
        config::key("colour", &s.colour).range(0, 100).help("Factor on the reflectance in each band"),
        config::key("colour_curve", config::Curve{&s.colour_curve})
            .range(0, 100)
            .help("Instead: the factor over wavelength, pairs of nm and factor; each band gets its mean"),
        config::key("emission_w_m2_sr", &s.emission_w_m2_sr)
            .unit("W m-2 sr-1")
            .range(0, 1e15)
            .help("Radiance that the outer side sends out by itself in each band"),
        config::key("albedo_texture", config::Path{&s.textures.albedo, true, true})
            .help("Image: factor on the reflectance; FITS, PNG, TIFF, JPEG, OpenEXR, PDS3"),
        config::key("normal_texture", config::Path{&s.textures.normal, true, true}).help("Image: normal map"),
        word_key("texture_coding", &s.textures.srgb, {{"linear", false}, {"srgb", true}},
                 "How the albedo image is coded"),
        word_key("texture_mapping", &s.textures.by_longitude, {{"own", false}, {"longitude", true}},
                 "By the shape's own coordinates where it has some, or by longitude and latitude"),
        config::key("texture_left_deg", config::Scaled{&s.textures.left_longitude_rad, degree})
            .unit("deg")
            .range(-360, 360)
            .help("Longitude of the left edge of an image that is mapped by longitude"),
    };
}

std::vector<ParameterTextureKeys> parameter_textures(const config::Keys& material) {
    std::vector<ParameterTextureKeys> out;
    for (const config::Key& key : material) {
        // Of the reflectance of these albedo_texture is a factor.
        if (key.name == "albedo" || key.name == "reflectance") continue;
        const auto* scaled = std::get_if<config::Scaled>(&key.target);
        const bool number = scaled != nullptr || std::holds_alternative<double*>(key.target);
        if (!number && key.name != "weight") continue;
        ParameterTextureKeys texture;
        texture.constant_key = key.name;
        texture.unit = key.unit();
        texture.parameter = key.name;
        if (!key.unit().empty()) texture.parameter.erase(texture.parameter.size() - key.unit().size() - 1);
        texture.file_key = texture.parameter + "_texture";
        texture.range_key = texture.parameter + "_texture_range";
        texture.help = "Instead: image of one plane that gives " + texture.constant_key;
        if (scaled != nullptr) texture.si = scaled->si;
        out.push_back(std::move(texture));
    }
    return out;
}

config::Keys keys_of(std::vector<ParameterTextureKeys>& textures) {
    config::Keys keys;
    for (ParameterTextureKeys& t : textures) {
        keys.push_back(config::key(t.file_key, config::Path{&t.file, true, true}).help(t.help));
        keys.push_back(config::key(t.range_key, config::Numbers{t.range.data(), t.range.size()})
                           .unit(t.unit)
                           .range(-1e6, 1e6)
                           .help("What a texel of 0 and one of 1 (of integers: full scale) stand for"));
    }
    return keys;
}

config::Keys keys_of(JointKeys& s) {
    return {
        config::key("parent", &s.parent).help("Body in whose frame position, orientation or trajectory are"),
        word_key("joint", &s.kind,
                 {{"fixed", scene::Joint::Kind::fixed},
                  {"hinge", scene::Joint::Kind::hinge},
                  {"slide", scene::Joint::Kind::slide}},
                 "How it moves besides: turns about joint_axis, or slides along it"),
        config::key("joint_axis", &s.axis).range(anywhere).help("Axis of the joint, in its own frame"),
        config::key("joint_angle_deg", &s.angle_deg).unit("deg").range(-1e6, 1e6).help("Angle of a hinge"),
        config::key("joint_offset_m", &s.offset_m).unit("m").range(anywhere).help("Offset of a slide"),
        config::key("joint_table", config::Path{&s.table, true, true})
            .help("Instead: CSV table time_s,angle_deg or time_s,offset_m"),
    };
}

config::Keys body_place_keys(PlaceKeys& s) {
    return {
        config::key("position_m", &s.position_m)
            .unit("m")
            .range(anywhere)
            .help("Position of the body frame's origin"),
        config::key("orientation", &s.orientation)
            .range(-1.001, 1.001)
            .help("Quaternion [w, x, y, z] from body axes to inertial, at time 0"),
        config::key("trajectory", config::Path{&s.trajectory})
            .help("Instead: CSV table time_s,x_m,y_m,z_m,qw,qx,qy,qz"),
        config::key("spin_axis", &s.spin_axis).range(anywhere).help("Axis of a uniform spin, body frame"),
        config::key("spin_rate_deg_per_s", &s.spin_rate_deg_per_s)
            .unit("deg/s")
            .range(-36000, 36000)
            .help("Rate of the spin"),
    };
}

config::Keys keys_of(LampKeys& s) {
    return {
        config::key("name", &s.name).help("Name; lamp0, lamp1, ... if not given"),
        config::key("beam", &s.beam)
            .choices({"point", "uniform", "gaussian"})
            .help("Shape of the beam about +z"),
        config::key("half_angle_deg", &s.half_angle_deg)
            .unit("deg")
            .range(0.001, 180)
            .help("Uniform: edge of the beam; gaussian: where exp(-2) of the axial intensity is left"),
        config::key("intensity_w_sr", &s.intensity_w_sr)
            .unit("W/sr")
            .range(0, 1e20)
            .help("On the axis, in each band"),
    };
}

config::Keys keys_of(scene::StrayLight& s) {
    return {
        config::key("file", config::Path{&s.file})
            .help("FITS or OpenEXR of the sensor's size: one plane, or one for each band"),
        config::key("w_m2_per_unit", &s.w_m2_per_unit)
            .unit("W/m2")
            .range(0, 1e12)
            .help("What 1 in the file adds to a pixel"),
        config::key("follows_sun", &s.follows_sun)
            .help("Times the Sun's irradiance at the camera over that at 1 au"),
    };
}

config::Keys keys_of(SpectralBand& s) {
    return {
        config::key("from_nm", config::Scaled{&s.from_m, nano})
            .unit("nm")
            .range(100, 20000)
            .help("Lower end of the band"),
        config::key("to_nm", config::Scaled{&s.to_m, nano})
            .unit("nm")
            .range(100, 20000)
            .help("Upper end of the band"),
        config::key("transmission", config::Curve{&s.transmission})
            .range(0, 1)
            .help("Of filter and optics: [nm, share] pairs, increasing in wavelength; 1 if not given"),
    };
}

} // namespace obscura::scene
