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
    return {name, config::Word{set, get}, {}, {}, std::move(choices), help};
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
        {"name", &s.name, {}, {}, {}, "Name of the scene; the file's own name if not given"},
        {"max_bounces",
         &s.max_bounces,
         {},
         {0, 1000},
         {},
         "Reflections after the first that light is followed over; 0: direct light only"},
        {"light_time", &s.light_time, {}, {}, {}, "Bodies are seen where they were when the light left them"},
        {"aberration", &s.aberration, {}, {}, {}, "Directions are those seen from the moving camera"},
        {"quantity",
         config::Word{set, get},
         {},
         {},
         {"irradiance", "radiance"},
         "What pixels hold: W/m2 at the pupil, or W m-2 sr-1"},
    };
}

config::Keys keys_of(SunKeys& s) {
    return {
        {"position_m", &s.position_m, "m", anywhere, {}, "Centre of the Sun"},
        {"direction", &s.direction, {}, anywhere, {}, "Instead: direction from the origin to the Sun"},
        {"distance_au", &s.distance_au, "au", {0.005, 1000}, {}, "Distance that goes with direction"},
        {"radius_m", &s.radius_m, "m", {1, 1e12}, {}, "Radius of the Sun's disc"},
        {"limb_darkening",
         &s.limb_darkening,
         {},
         {0, 1},
         {},
         "u of the linear law 1 - u (1 - mu), about 0.6 for visible light; 0: a uniform disc"},
        {"irradiance_scale", &s.irradiance_scale, {}, {0, 1e6}, {}, "Times the ASTM E490 spectrum"},
    };
}

config::Keys keys_of(StarKeys& s) {
    return {
        {"catalogue", config::Path{&s.catalogue}, {}, {}, {}, "CSV table: ra_deg,dec_deg,v_mag,b_v (J2000)"},
        {"limiting_magnitude", &s.limiting_magnitude, "mag", {-30, 40}, {}, "Fainter stars are left out"},
    };
}

config::Keys keys_of(scene::Camera& s) {
    using Model = scene::Distortion::Model;
    return {
        {"width", &s.width, "px", {1, 65536}, {}, "Columns; in a daemon the sensor's"},
        {"height", &s.height, "px", {1, 65536}, {}, "Rows; in a daemon the sensor's"},
        {"pixel_pitch_um",
         config::Scaled{&s.pixel_pitch_m, micro},
         "um",
         {0.1, 1000},
         {},
         "In a daemon the sensor's"},
        {"focal_length_mm", config::Scaled{&s.focal_length_m, milli}, "mm", {0.1, 1e6}, {}, "Focal length"},
        {"aperture_mm",
         config::Scaled{&s.aperture_m, milli},
         "mm",
         {0.001, 1e5},
         {},
         "Diameter of the entrance pupil"},
        {"psf_sigma_px",
         &s.psf_sigma_px,
         "px",
         {0, 20},
         {},
         "Standard deviation of the Gaussian point spread function; 0: each star in one pixel"},
        {"velocity_m_s",
         &s.velocity_m_s,
         "m/s",
         {-2.9e8, 2.9e8},
         {},
         "For aberration: velocity in the inertial frame; that of the trajectory if not given"},
        word_key("psf", &s.psf.model,
                 {{"gaussian", scene::PointSpread::Model::gaussian},
                  {"airy", scene::PointSpread::Model::airy},
                  {"table", scene::PointSpread::Model::table}},
                 "Point spread function: gaussian (psf_sigma_px), airy (diffraction at the aperture), table"),
        {"psf_obscuration",
         &s.psf.obscuration,
         {},
         {0, 0.99},
         {},
         "Diameter of the central obscuration over that of the aperture"},
        {"psf_defocus_um",
         config::Scaled{&s.psf.defocus_m, micro},
         "um",
         {-1e5, 1e5},
         {},
         "Distance of the focus from the sensor, with gaussian and airy"},
        {"psf_file",
         config::Path{&s.psf.file},
         {},
         {},
         {},
         "Table: FITS images of a point; OVERSAMP samples a pixel, FIELDX, FIELDY, BAND"},
        {"psf_core_px",
         &s.psf.core_px,
         "px",
         {2, 128},
         {},
         "Radius within which camera samples are spread, with airy, table or defocus"},
        {"psf_wings_px",
         &s.psf.wings_px,
         "px",
         {0, 65536},
         {},
         "How far the light beyond the core is followed; 0: all is put into the core"},
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
        {"distortion_coefficients",
         &s.distortion.coefficients,
         {},
         {-1e6, 1e6},
         {},
         "brown-conrady (real to ideal): k1 k2 k3 p1 p2; opencv: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4; "
         "radial: "
         "k1 k2 k3 k4"},
        {"distortion_ideal_mm",
         &s.distortion.ideal_mm,
         "mm",
         {0, 1e6},
         {},
         "Table: distances from the centre that the projection gives, from 0 up"},
        {"distortion_real_mm",
         &s.distortion.real_mm,
         "mm",
         {0, 1e6},
         {},
         "Table: where the lens really forms them"},
        {"principal_offset_px",
         config::Numbers{s.principal_offset_px.data(), s.principal_offset_px.size()},
         "px",
         {-65536, 65536},
         {},
         "Where the optical axis meets the sensor, from its centre: right, down"},
        {"sensor_rotation_deg",
         config::Scaled{&s.sensor_rotation_rad, degree},
         "deg",
         {-360, 360},
         {},
         "Rotation of the sensor about the optical axis, right towards down"},
        word_key(
            "vignetting", &s.pupil_cosine, {{"none", false}, {"cos4", true}},
            "cos4: light weakened by the cosine of its angle to the boresight, with the solid angle of a "
            "pinhole's pixels the cos^4 law"),
    };
}

config::Keys camera_place_keys(PlaceKeys& s) {
    return {
        {"position_m", &s.position_m, "m", anywhere, {}, "Position"},
        {"orientation",
         &s.orientation,
         {},
         {-1.001, 1.001},
         {},
         "Quaternion [w, x, y, z] from camera axes (x right, y down, z boresight) to inertial"},
        {"boresight", &s.boresight, {}, anywhere, {}, "Instead: direction of view"},
        {"look_at_m", &s.look_at_m, "m", anywhere, {}, "Instead: point in view"},
        {"up", &s.up, {}, anywhere, {}, "Direction that is up in the image, with boresight or look_at_m"},
        {"trajectory",
         config::Path{&s.trajectory},
         {},
         {},
         {},
         "Instead: CSV table time_s,x_m,y_m,z_m,qw,qx,qy,qz"},
    };
}

config::Keys keys_of(BodyKeys& s) {
    return {
        {"name", &s.name, {}, {}, {}, "Name; body0, body1, ... if not given"},
        {"shape", &s.shape, {}, {}, names_of(shape_kinds()), "Kind of shape; its own keys stand beside"},
        {"material", &s.material, {}, {}, names_of(material_kinds()), "Photometric model; likewise"},
        {"colour", &s.colour, {}, {0, 100}, {}, "Factor on the reflectance in each band"},
        {"colour_curve",
         config::Curve{&s.colour_curve},
         {},
         {0, 100},
         {},
         "Instead: the factor over wavelength, pairs of nm and factor; each band gets its mean"},
        {"emission_w_m2_sr",
         &s.emission_w_m2_sr,
         "W m-2 sr-1",
         {0, 1e15},
         {},
         "Radiance that the outer side sends out by itself in each band"},
        {"albedo_texture",
         config::Path{&s.textures.albedo, true, true},
         {},
         {},
         {},
         "Image: factor on the reflectance; FITS, PNG, TIFF, JPEG, OpenEXR, PDS3"},
        {"normal_texture", config::Path{&s.textures.normal, true, true}, {}, {}, {}, "Image: normal map"},
        word_key("texture_coding", &s.textures.srgb, {{"linear", false}, {"srgb", true}},
                 "How the albedo image is coded"),
        word_key("texture_mapping", &s.textures.by_longitude, {{"own", false}, {"longitude", true}},
                 "By the shape's own coordinates where it has some, or by longitude and latitude"),
        {"texture_left_deg",
         config::Scaled{&s.textures.left_longitude_rad, degree},
         "deg",
         {-360, 360},
         {},
         "Longitude of the left edge of an image that is mapped by longitude"},
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
        texture.unit = key.unit;
        texture.parameter = key.name;
        if (!key.unit.empty()) texture.parameter.erase(texture.parameter.size() - key.unit.size() - 1);
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
        keys.push_back({t.file_key, config::Path{&t.file, true, true}, {}, {}, {}, t.help});
        keys.push_back({t.range_key,
                        config::Numbers{t.range.data(), t.range.size()},
                        t.unit,
                        {-1e6, 1e6},
                        {},
                        "What a texel of 0 and one of 1 (of integers: full scale) stand for"});
    }
    return keys;
}

config::Keys keys_of(JointKeys& s) {
    return {
        {"parent", &s.parent, {}, {}, {}, "Body in whose frame position, orientation or trajectory are"},
        word_key("joint", &s.kind,
                 {{"fixed", scene::Joint::Kind::fixed},
                  {"hinge", scene::Joint::Kind::hinge},
                  {"slide", scene::Joint::Kind::slide}},
                 "How it moves besides: turns about joint_axis, or slides along it"),
        {"joint_axis", &s.axis, {}, anywhere, {}, "Axis of the joint, in its own frame"},
        {"joint_angle_deg", &s.angle_deg, "deg", {-1e6, 1e6}, {}, "Angle of a hinge"},
        {"joint_offset_m", &s.offset_m, "m", anywhere, {}, "Offset of a slide"},
        {"joint_table",
         config::Path{&s.table, true, true},
         {},
         {},
         {},
         "Instead: CSV table time_s,angle_deg or time_s,offset_m"},
    };
}

config::Keys body_place_keys(PlaceKeys& s) {
    return {
        {"position_m", &s.position_m, "m", anywhere, {}, "Position of the body frame's origin"},
        {"orientation",
         &s.orientation,
         {},
         {-1.001, 1.001},
         {},
         "Quaternion [w, x, y, z] from body axes to inertial, at time 0"},
        {"trajectory",
         config::Path{&s.trajectory},
         {},
         {},
         {},
         "Instead: CSV table time_s,x_m,y_m,z_m,qw,qx,qy,qz"},
        {"spin_axis", &s.spin_axis, {}, anywhere, {}, "Axis of a uniform spin, body frame"},
        {"spin_rate_deg_per_s", &s.spin_rate_deg_per_s, "deg/s", {-36000, 36000}, {}, "Rate of the spin"},
    };
}

config::Keys keys_of(LampKeys& s) {
    return {
        {"name", &s.name, {}, {}, {}, "Name; lamp0, lamp1, ... if not given"},
        {"beam", &s.beam, {}, {}, {"point", "uniform", "gaussian"}, "Shape of the beam about +z"},
        {"half_angle_deg",
         &s.half_angle_deg,
         "deg",
         {0.001, 180},
         {},
         "Uniform: edge of the beam; gaussian: where exp(-2) of the axial intensity is left"},
        {"intensity_w_sr", &s.intensity_w_sr, "W/sr", {0, 1e20}, {}, "On the axis, in each band"},
    };
}

config::Keys keys_of(scene::StrayLight& s) {
    return {
        {"file",
         config::Path{&s.file},
         {},
         {},
         {},
         "FITS or OpenEXR of the sensor's size: one plane, or one for each band"},
        {"w_m2_per_unit", &s.w_m2_per_unit, "W/m2", {0, 1e12}, {}, "What 1 in the file adds to a pixel"},
        {"follows_sun",
         &s.follows_sun,
         {},
         {},
         {},
         "Times the Sun's irradiance at the camera over that at 1 au"},
    };
}

config::Keys keys_of(SpectralBand& s) {
    return {
        {"from_nm", config::Scaled{&s.from_m, nano}, "nm", {100, 20000}, {}, "Lower end of the band"},
        {"to_nm", config::Scaled{&s.to_m, nano}, "nm", {100, 20000}, {}, "Upper end of the band"},
        {"transmission",
         config::Curve{&s.transmission},
         {},
         {0, 1},
         {},
         "Of filter and optics: [nm, share] pairs, increasing in wavelength; 1 if not given"},
    };
}

} // namespace obscura::scene
