// SPDX-License-Identifier: Apache-2.0
// Configurations that must load, and what must come out of them.
#include "emulator/config/daemon_config.hpp"
#include "renderer/materials/ggx.hpp"
#include "renderer/materials/hapke.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/materials/lommel_seeliger.hpp"
#include "renderer/materials/lunar_lambert.hpp"
#include "renderer/materials/minnaert.hpp"
#include "renderer/materials/mirror.hpp"
#include "renderer/materials/oren_nayar.hpp"
#include "renderer/materials/phong.hpp"
#include "renderer/mesh_files/mesh_file.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "renderer/shapes/polygons.hpp"
#include "renderer/shapes/procedural_body.hpp"
#include "sync/sources/gpio.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"
#include "transports/file/settings.hpp"
#include "transports/gige/settings.hpp"
#include "transports/stimulator/settings.hpp"
#include "transports/v4l2/settings.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace config_test {

using namespace obscura;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr const char* small_scene = R"([[body]]
shape = "ellipsoid"
radii_m = [3, 2, 1]
albedo = 0.2
)";

constexpr double degree = std::numbers::pi / 180;

const transports::gige::GigeSettings& gige_of(const emulator::DaemonConfig& config) {
    return config.transports.get<transports::gige::GigeSettings>();
}
const transports::FileSinkSettings& file_of(const emulator::DaemonConfig& config) {
    return config.transports.get<transports::FileSinkSettings>();
}
const transports::StimulatorSettings& stimulator_of(const emulator::DaemonConfig& config) {
    return config.transports.get<transports::StimulatorSettings>();
}

} // namespace

TEST_CASE("the smallest configuration keeps every default") {
    const test::TempFolder folder;
    folder.write("scene.toml", small_scene);
    const auto config = emulator::load_config(folder.write("c.toml", "[scene]\nfile = \"scene.toml\"\n"));
    const emulator::DaemonConfig fresh;
    CHECK(config.scene_file == folder.path() / "scene.toml");
    CHECK(config.daemon.seed == fresh.daemon.seed);
    CHECK(config.trigger.lines[0].rate_hz == fresh.trigger.lines[0].rate_hz);
    CHECK(gige_of(config).packet_size == gige_of(fresh).packet_size);
    CHECK(file_of(config).directory == (folder.path() / "frames").string());
    // The default sensor decides the size of the picture.
    CHECK(config.scene.camera.width == fresh.sensor.readout.width);
    CHECK(config.scene.camera.pixel_pitch_m == fresh.sensor.pixel_pitch_m);
    REQUIRE(config.scene.bodies.size() == 1);
    CHECK(config.scene.bodies[0].name == "body0");
    CHECK(config.scene.bodies[0].shape.get<renderer::EllipsoidParameters>().radii_m == Vec3{3, 2, 1});
    const CameraSettings camera = emulator::camera_settings(config);
    CHECK(camera.region == Region{0, 0, 1024, 1024});
    CHECK(camera.exposure_ns == 10'000'000);
    CHECK(camera.frame_trigger.source == TriggerSource::line0);
}

TEST_CASE("print() loads back to itself, from any folder") {
    const test::TempFolder folder;
    folder.write("sub/scene.toml", small_scene);
    const auto first = emulator::load_config(folder.write("sub/c.toml", R"(
[scene]
file = "scene.toml"
[daemon]
log_level = "debug"
seed = 123456789012345
scene_time = "clock"
[render]
samples_per_pixel = 7
[trigger]
rate_hz = 29.97
phase_ms = 0.1
[trigger.line2]
source = "gpio"
line = "GATE_IN"
edge = "both"
[camera]
width = 320
offset_x = 16
exposure_us = 333.333
pixel_format = "Mono8"
trigger_mode = "Off"
trigger_source = "Line2"
trigger_activation = "FallingEdge"
exposure_mode = "TriggerWidth"
[gige]
user_name = 'quo"te \ back'
drop_percent = 1
[[gige.faults]]
kind = "lose"
percent = 0.5
burst_packets = 50
[[gige.faults]]
kind = "wrong_timestamp"
amount = -12.5
last = 7
[file]
directory = "../out"
format = "fits"
[v4l2]
enabled = true
device = "/dev/video7"
format = "GREY"
io = "write"
frame_counter = true
[stimulator]
product_id = 0x10a9
serial = "B-7"
calibration = "bench.fits"
format = "XRGB8888"
grey = "sum"
[sensor]
name = "tab	here"
pixel_pitch_um = 6.9
serial = 42
[sensor.readout]
width = 640
shutter = "global"
frame_overhead_ns = 12000
overlapped = false
[sensor.detector]
quantum_efficiency = [[400.5, 0.3], [700, 0.65], [1000.1, 0]]
read_noise_e = 2.2
adc_bits = 14
)"));
    const std::string text = emulator::print_config(first);
    const auto second = emulator::load_config(folder.write("elsewhere/printed.toml", text));
    // All but the first line, which names the source.
    const auto body = [](const std::string& s) { return s.substr(s.find('\n')); };
    CHECK(body(emulator::print_config(second)) == body(text));
    CHECK(gige_of(second).user_name == "quo\"te \\ back");
    REQUIRE(gige_of(second).faults.size() == 2);
    CHECK(gige_of(second).faults[0].burst == 50);
    CHECK(gige_of(second).faults[1].amount == -12.5);
    CHECK(second.sensor.name == "tab\there");
    CHECK(second.sensor.pixel_pitch_m == first.sensor.pixel_pitch_m);
    CHECK(second.sensor.detector.quantum_efficiency.size() == 3);
    CHECK(second.sensor.detector.quantum_efficiency[2].wavelength_m ==
          first.sensor.detector.quantum_efficiency[2].wavelength_m);
    CHECK(second.sensor.readout.shutter == Shutter::global);
    CHECK(second.trigger.lines[0].rate_hz == 29.97);
    CHECK(second.trigger.lines[0].source == "timer");
    CHECK(second.trigger.lines[1].source == "none");
    sync::TriggerLineSettings line2 = second.trigger.lines[2];
    CHECK(line2.kinds.get<sync::GpioKind>().line == "GATE_IN");
    CHECK(emulator::camera_settings(second).frame_trigger.source == TriggerSource::line2);
    CHECK(emulator::camera_settings(second).exposure_mode == ExposureMode::trigger_width);
    CHECK(second.daemon.seed == 123456789012345u);
    CHECK(file_of(second).directory == (folder.path() / "out").string());
    CHECK(second.transports.get<transports::V4l2Settings>().device == "/dev/video7");
    CHECK(second.transports.get<transports::V4l2Settings>().format == transports::V4l2Format::grey);
    CHECK(stimulator_of(second).product_id == 0x10a9);
    CHECK(stimulator_of(second).grey == transports::GreyCoding::sum);
    CHECK(stimulator_of(second).calibration == stimulator_of(first).calibration);
    CHECK(stimulator_of(second).calibration.find((folder.path() / "").string()) == 0);
    CHECK(emulator::camera_settings(second) == emulator::camera_settings(first));
}

TEST_CASE("several windows are read in their order and printed again") {
    const test::TempFolder folder;
    folder.write("scene.toml", small_scene);
    const auto config = emulator::load_config(folder.write("c.toml", R"(
[scene]
file = "scene.toml"
[camera]
exposure_us = 2500
rows_max = 2048
[[camera.window]]
width = 20
height = 30
offset_x = 100
offset_y = 200
exposure_us = 100
[[camera.window]]
width = 64
height = 64
sampling = "non-destructive"
reads = 4
)"));
    const CameraSettings camera = emulator::camera_settings(config);
    REQUIRE(camera.window_count() == 2);
    CHECK(camera.window(0) == CameraWindow{{100, 200, 20, 30}, 100'000});
    CHECK(camera.window(1) == CameraWindow{{0, 0, 64, 64}, 2'500'000, Sampling::non_destructive, 4});
    CHECK(composed_size(camera) == ImageSize{64, 30 + 4 * 64});
    const std::string printed = emulator::print_config(config);
    const auto again = emulator::load_config(folder.write("again.toml", printed));
    CHECK(emulator::camera_settings(again) == camera);
    CHECK(again.camera.rows_max == 2048);
    // Each of several cameras has windows of its own.
    const auto two = emulator::load_config(folder.write("two.toml", R"([scene]
file = "scene.toml"
[gige]
enabled = false
[[camera]]
[[camera.window]]
width = 20
height = 30
[[camera]]
[[camera.window]]
width = 40
height = 50
[[camera.window]]
width = 60
height = 70
)"));
    CHECK(emulator::camera_settings(two).window_count() == 1);
    CHECK(emulator::camera_settings(two.others.at(0)).window(1).region == Region{0, 0, 60, 70});
    const auto two_again = emulator::load_config(folder.write("two_again.toml", emulator::print_config(two)));
    CHECK(emulator::camera_settings(two_again.others.at(0)) == emulator::camera_settings(two.others.at(0)));
    CHECK(emulator::print_config(again).substr(emulator::print_config(again).find('\n')) ==
          printed.substr(printed.find('\n')));
}

TEST_CASE("a sensor file is read first, keys beside it override it, values may tell where they come from") {
    const test::TempFolder folder;
    folder.write("scene.toml", small_scene);
    folder.write("sensors/x.toml", R"(
name = "X100"
pixel_pitch_um = { value = 4.8, provenance = "datasheet", source = "X100 data sheet rev. 3, table 2" }
[readout]
width = { value = 800, provenance = "datasheet" }
height = 600
[detector]
read_noise_e = 3
quantum_efficiency = { value = [[500, 0.7]], provenance = "measured", source = "bench" }
)");
    const auto config = emulator::load_config(folder.write("c.toml", R"(
[scene]
file = "scene.toml"
[sensor]
file = "sensors/x.toml"
serial = 9
[sensor.detector]
read_noise_e = 4
)"));
    CHECK(config.sensor.name == "X100");
    CHECK(config.sensor.serial == 9);
    CHECK_THAT(config.sensor.pixel_pitch_m, WithinRel(4.8e-6, 1e-15));
    CHECK(config.sensor.readout.width == 800);
    CHECK(config.sensor.detector.read_noise_e == 4);
    CHECK(config.sensor.detector.quantum_efficiency[0].value == 0.7);
    CHECK(config.scene.camera.width == 800);
    CHECK(config.scene.camera.height == 600);
    CHECK_THAT(config.scene.camera.pixel_pitch_m, WithinRel(4.8e-6, 1e-15));
}

TEST_CASE("a scene with everything in it") {
    const test::TempFolder folder;
    folder.write("stars.csv",
                 "# two stars\nra_deg,dec_deg,v_mag,b_v\n101.28717,-16.71611,-1.44,0.01\n10,20,7.5,1\n");
    folder.write(
        "path.csv",
        "time_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,1,2,3,1,0,0,0\r\n10, 4,5,6, 0.70710678,0,0,-0.70710678\n");
    folder.write("m.obj", "v 0 0 0\n");
    const auto scene = scene::load_scene(folder.write("s.toml", R"(
[sun]
direction = [0, 2, 0]
distance_au = 2
irradiance_scale = 0.5
[stars]
catalogue = "stars.csv"
limiting_magnitude = 6
[camera]
width = 100
height = 50
pixel_pitch_um = 10
focal_length_mm = 100
aperture_mm = 20
psf_sigma_px = 0
position_m = [0, 0, -1000]
look_at_m = [0, 0, 0]
up = [0, 1, 0]
[[body]]
name = "a"
shape = "mesh"
file = "m.obj"
metres_per_unit = 1000
smooth_normals = false
material = "lommel-seeliger"
albedo = 0.3
trajectory = "path.csv"
spin_axis = [0, 0, 2]
spin_rate_deg_per_s = 90
[[body]]
name = "b"
shape = "procedural"
mean_radius_m = 250
seed = 77
albedo = 1
[[band]]
from_nm = 400
to_nm = 500
[[band]]
from_nm = 500
to_nm = 700
)"));
    CHECK(scene.name == "s");
    CHECK_THAT(scene.sun.position_m.y, WithinRel(2 * 149597870700.0, 1e-15));
    CHECK(scene.sun.position_m.x == 0);
    CHECK(scene.sun.irradiance_scale == 0.5);
    REQUIRE(scene.stars.size() == 1); // the fainter one is left out
    CHECK_THAT(scene.stars[0].right_ascension_rad, WithinRel(101.28717 * degree, 1e-14));
    CHECK_THAT(scene.stars[0].declination_rad, WithinRel(-16.71611 * degree, 1e-14));
    CHECK_THAT(scene.camera.focal_length_m, WithinRel(0.1, 1e-15));
    CHECK_THAT(scene.camera.aperture_m, WithinRel(0.02, 1e-15));
    const Pose camera = scene.camera.motion.samples.at(0).pose;
    const Vec3 ahead = rotate(camera.orientation, {0, 0, 1});
    const Vec3 up = rotate(camera.orientation, {0, -1, 0});
    CHECK_THAT(ahead.z, WithinAbs(1, 1e-15));
    CHECK_THAT(up.y, WithinAbs(1, 1e-15));
    REQUIRE(scene.bodies.size() == 2);
    const auto& mesh = scene.bodies[0].shape.get<renderer::MeshFileParameters>();
    CHECK(mesh.path == (folder.path() / "m.obj").string());
    CHECK(mesh.metres_per_unit == 1000);
    CHECK_FALSE(mesh.smooth_normals);
    CHECK(scene.bodies[0].material.get<renderer::LommelSeeligerParameters>().albedo == 0.3);
    const scene::Motion& motion = scene.bodies[0].motion;
    CHECK_THAT(motion.spin_rate_rad_s, WithinRel(std::numbers::pi / 2, 1e-15));
    REQUIRE(motion.samples.size() == 2);
    CHECK(motion.samples[1].time_s == 10);
    CHECK(motion.samples[1].pose.position_m == Vec3{4, 5, 6});
    CHECK_THAT(norm(motion.samples[1].pose.orientation), WithinAbs(1, 1e-15));
    CHECK_THAT(motion.samples[1].pose.orientation.z, WithinAbs(-std::sqrt(0.5), 1e-8));
    CHECK(scene.bodies[1].shape.get<renderer::ProceduralBodyParameters>().seed == 77);
    CHECK(scene.bodies[1].material.get<renderer::LambertParameters>().albedo == 1);
    REQUIRE(scene.bands.size() == 2);
    CHECK_THAT(scene.bands[1].to_m, WithinRel(700e-9, 1e-15));
}

TEST_CASE("every material has its own parameters") {
    const test::TempFolder folder;
    const auto material = [&](const std::string& text) {
        const auto file = folder.write(
            "s.toml", "[[body]]\nshape = \"ellipsoid\"\nradii_m = [1, 1, 1]\nmaterial = " + text);
        return scene::load_scene(file).bodies.at(0).material;
    };
    CHECK(material("\"lambert\"\nalbedo = 0.25\n").get<renderer::LambertParameters>().albedo == 0.25);
    const auto lunar = material("\"lunar-lambert\"\nalbedo = 0.2\nweight = [1, -0.5, 0, 2]\n")
                           .get<renderer::LunarLambertParameters>();
    CHECK(lunar.weight == std::array<double, 4>{1, -0.5, 0, 2});
    CHECK(material("\"minnaert\"\nalbedo = 0.2\nexponent = 0.6\n")
              .get<renderer::MinnaertParameters>()
              .exponent == 0.6);
    CHECK_THAT(material("\"oren-nayar\"\nalbedo = 0.2\nslope_deg = 30\n")
                   .get<renderer::OrenNayarParameters>()
                   .slope_rad,
               WithinRel(30 * degree, 1e-15));
    CHECK(material("\"phong\"\nspecular = 0.7\n").get<renderer::PhongParameters>().specular == 0.7);
    const auto hapke =
        material("\"hapke\"\nsingle_scattering_albedo = 0.4\nroughness_deg = 20\nphase_b = 0.2\n")
            .get<renderer::HapkeParameters>();
    CHECK(hapke.single_scattering_albedo == 0.4);
    CHECK(hapke.phase_b == 0.2);
    CHECK_THAT(hapke.roughness_rad, WithinRel(20 * degree, 1e-15));
    CHECK(material("\"ggx\"\nroughness = 0.1\n").get<renderer::GgxParameters>().roughness == 0.1);
}

TEST_CASE("the shipped configuration and scene load") {
    const auto config = emulator::load_config(OBSCURA_SOURCE_DIR "/config/demo.toml");
    CHECK(config.trigger.lines[0].rate_hz == 5);
    CHECK(config.scene.bodies.size() == 1);
    CHECK(config.scene.stars.size() > 4000);
    // Sirius, from the Hipparcos catalogue: HIP 32349, ra 101.2872, dec -16.7161.
    CHECK_THAT(config.scene.stars[0].right_ascension_rad / degree, WithinAbs(101.28716, 1e-4));
    CHECK_THAT(config.scene.stars[0].declination_rad / degree, WithinAbs(-16.71612, 1e-4));
}

TEST_CASE("shipped configurations that render in a real-time class give away quality, not time") {
    int in_real_time = 0;
    for (const auto& entry : std::filesystem::directory_iterator(OBSCURA_SOURCE_DIR "/config")) {
        if (entry.path().extension() != ".toml") continue;
        CAPTURE(entry.path().string());
        const auto config = emulator::load_config(entry.path());
        if (config.threads.render_class == emulator::RenderClass::other) continue;
        ++in_real_time;
        CHECK(config.deadline.quality == emulator::QualityPolicy::adapt);
    }
    CHECK(in_real_time == 2);
}

TEST_CASE("the shipped configuration for 10 Hz loads") {
    const auto config = emulator::load_config(OBSCURA_SOURCE_DIR "/config/realtime.toml");
    CHECK(config.trigger.lines[0].rate_hz == 10);
    CHECK(config.render.target_error == 0.02);
    CHECK(config.sensor.readout.width == 1024);
    CHECK(config.sensor.readout.height == 1024);
    CHECK(config.scene.camera.width == 1024);
    CHECK(config.scene.stars.size() > 4000);
}

TEST_CASE("the Cornell box loads with its measured spectra") {
    const scene::Scene scene = scene::load_scene(OBSCURA_SOURCE_DIR "/config/scenes/cornell.toml");
    REQUIRE(scene.bodies.size() == 8);
    REQUIRE(scene.bands.size() == 7);
    CHECK(scene.quantity == scene::Quantity::radiance);
    CHECK(scene.max_bounces == 12);
    CHECK(scene.sun.irradiance_scale == 0);
    const auto red = std::find_if(scene.bodies.begin(), scene.bodies.end(),
                                  [](const scene::Body& b) { return b.name == "red wall"; });
    REQUIRE(red != scene.bodies.end());
    // Published: 400 nm 0.040, 700 nm 0.642.
    CHECK(red->colour.front() == 0.04);
    CHECK_THAT(red->colour.back(), WithinAbs(0.64, 0.02));
    const auto light = std::find_if(scene.bodies.begin(), scene.bodies.end(),
                                    [](const scene::Body& b) { return !b.emission_w_m2_sr.empty(); });
    REQUIRE(light != scene.bodies.end());
    CHECK(light->emission_w_m2_sr == std::vector<double>{0, 4, 8, 11.8, 15.6, 17, 18.4});
    CHECK(light->shape.get<renderer::PolygonsParameters>().faces_m[0].size() == 4);
}

TEST_CASE("a lens of a scene file") {
    const test::TempFolder folder;
    const auto scene = scene::load_scene(folder.write("lens.toml", R"(
[camera]
projection = "stereographic"
distortion = "table"
distortion_ideal_mm = [0, 1, 2]
distortion_real_mm = [0, 0.99, 1.9]
principal_offset_px = [1.5, -2]
sensor_rotation_deg = 90
vignetting = "cos4"
)"));
    const scene::Camera& c = scene.camera;
    CHECK(c.projection == scene::Projection::stereographic);
    CHECK(c.distortion.model == scene::Distortion::Model::table);
    CHECK(c.distortion.ideal_mm == std::vector<double>{0, 1, 2});
    CHECK(c.distortion.real_mm == std::vector<double>{0, 0.99, 1.9});
    CHECK(c.principal_offset_px == std::array<double, 2>{1.5, -2});
    CHECK_THAT(c.sensor_rotation_rad, WithinRel(90 * degree, 1e-15));
    CHECK(c.pupil_cosine);
}

TEST_CASE("materials and lamps of a scene file") {
    const test::TempFolder folder;
    const auto file = folder.write("s.toml", R"(
[[body]]
shape = "ellipsoid"
radii_m = [1, 1, 1]
material = "hapke"
single_scattering_albedo = 0.2
roughness_deg = 20
[[body]]
shape = "ellipsoid"
radii_m = [1, 1, 1]
material = "phong"
diffuse = 0.1
specular = 0.6
[[body]]
shape = "ellipsoid"
radii_m = [1, 1, 1]
material = "minnaert"
albedo = 0.3
exponent = 0.6
[[body]]
shape = "ellipsoid"
radii_m = [1, 1, 1]
material = "mirror"
reflectance = 0.8
emission_w_m2_sr = [2.5]
[[lamp]]
beam = "gaussian"
half_angle_deg = 5
intensity_w_sr = [12]
position_m = [1, 2, 3]
)");
    const scene::Scene scene = scene::load_scene(file);
    REQUIRE(scene.bodies.size() == 4);
    const auto& hapke = scene.bodies[0].material.get<renderer::HapkeParameters>();
    CHECK(hapke.single_scattering_albedo == 0.2);
    CHECK_THAT(hapke.roughness_rad, WithinRel(20 * degree, 1e-12));
    const auto& phong = scene.bodies[1].material.get<renderer::PhongParameters>();
    CHECK(phong.specular == 0.6);
    CHECK(phong.exponent == renderer::PhongParameters{}.exponent);
    CHECK(scene.bodies[2].material.get<renderer::MinnaertParameters>().exponent == 0.6);
    CHECK(scene.bodies[3].material.get<renderer::MirrorParameters>().reflectance == 0.8);
    CHECK(scene.bodies[3].emission_w_m2_sr == std::vector<double>{2.5});
    REQUIRE(scene.lamps.size() == 1);
    CHECK(scene.lamps[0].name == "lamp0");
    CHECK(scene.lamps[0].beam == scene::Lamp::Beam::gaussian);
    CHECK(scene.lamps[0].motion.samples[0].pose.position_m == Vec3{1, 2, 3});
}

TEST_CASE("several cameras: each has the file's tables with its own laid over them") {
    const test::TempFolder folder;
    folder.write("scene.toml", "[camera]\nfocal_length_mm = 70\nposition_m = [1, 2, 3]\n");
    const auto first = emulator::load_config(folder.write("c.toml", R"([scene]
file = "scene.toml"
[daemon]
seed = 5
[trigger]
rate_hz = 7
[trigger.line3]
source = "udp"
[gige]
packet_size = 8000
[[gige.faults]]
kind = "lose"
[sensor.readout]
width = 320
height = 240
[[camera]]
gain_db = 3
gige = { interface = "127.0.0.2", serial = "A", mac = "02:00:00:00:00:0a" }
[[camera]]
[camera.view]
focal_length_mm = 35
[camera.gige]
interface = "127.0.0.3"
serial = "B"
faults = []
[camera.sensor.readout]
width = 640
[[camera]]
[camera.view]
position_m = [9, 9, 9]
boresight = [1, 0, 0]
up = [0, 0, 1]
[camera.trigger]
rate_hz = 3
[camera.gige]
enabled = false
)"));
    const auto look = [](const emulator::DaemonConfig& config) {
        const auto cameras = config.cameras();
        REQUIRE(cameras.size() == 3);
        const emulator::DaemonConfig &a = *cameras[0], &b = *cameras[1], &c = *cameras[2];
        CHECK(a.several);
        CHECK(a.camera.settings.gain_db == 3);
        CHECK(b.camera.settings.gain_db == 0);
        CHECK(gige_of(a).serial == "A");
        CHECK(gige_of(a).mac == "02:00:00:00:00:0a");
        CHECK(gige_of(b).packet_size == 8000);
        CHECK(gige_of(a).faults.size() == 1);
        CHECK(gige_of(b).faults.empty());
        CHECK(gige_of(c).faults.size() == 1);
        CHECK_FALSE(gige_of(c).enabled);
        CHECK(a.sensor.readout.width == 320);
        CHECK(b.sensor.readout.width == 640);
        CHECK(b.sensor.readout.height == 240);
        CHECK(b.scene.camera.width == 640);
        CHECK(a.scene.camera.focal_length_m == 0.07);
        CHECK(b.scene.camera.focal_length_m == 0.035);
        CHECK(b.scene.camera.motion.samples.at(0).pose.position_m.x == 1);
        CHECK(c.scene.camera.motion.samples.at(0).pose.position_m.x == 9);
        CHECK(c.scene.camera.focal_length_m == 0.07);
        CHECK_FALSE(a.own_trigger);
        CHECK(a.trigger.lines[0].rate_hz == 7);
        CHECK(c.own_trigger);
        CHECK(c.trigger.lines[0].rate_hz == 3);
        CHECK(a.trigger.lines[3].source == "udp");
        CHECK(a.trigger.lines[3] == c.trigger.lines[3]); // which they share
        CHECK(c.daemon.seed == 5);
    };
    look(first);
    const std::string text = emulator::print_config(first);
    const auto second = emulator::load_config(folder.write("elsewhere/printed.toml", text));
    look(second);
    const auto body = [](const std::string& s) { return s.substr(s.find('\n')); };
    CHECK(body(emulator::print_config(second)) == body(text));
}

} // namespace config_test
