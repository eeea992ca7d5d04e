// SPDX-License-Identifier: Apache-2.0
// Broken files and command lines, given to the program as a user would: one line on standard error, nothing
// on standard output, the right exit status, and nothing half-made left behind.
#include "tests/support/catch.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/temp_folder.hpp"

#include <algorithm>
#include <string>
#include <vector>

namespace bad_input_test {

using namespace obscura::test;
using namespace std::chrono_literals;

namespace {

const std::string program = OBSCURA_BINARY_DIR "/tools/obscura";

struct Outcome {
    int status = -1;
    std::string line; ///< standard error, with the folder's name taken out
};

Outcome run(const TempFolder& folder, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), program);
    ChildProcess child(folder.path(), "obscura", arguments);
    Outcome outcome;
    outcome.status = child.wait(60s).value_or(-1);
    outcome.line = child.err();
    CHECK(child.out().empty());
    // Exactly one line.
    REQUIRE(std::count(outcome.line.begin(), outcome.line.end(), '\n') == 1);
    REQUIRE(outcome.line.back() == '\n');
    outcome.line.pop_back();
    const std::string prefix = folder.path().string() + "/";
    for (std::size_t at; (at = outcome.line.find(prefix)) != std::string::npos;)
        outcome.line.erase(at, prefix.size());
    return outcome;
}

constexpr const char* body = "[[body]]\nshape = \"mesh\"\nfile = \"m.obj\"\nalbedo = 0.5\n";
constexpr const char* triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

void check_mesh(const std::string& mesh, const std::string& line) {
    const TempFolder folder;
    folder.write("m.obj", mesh);
    const auto scene = folder.write("s.toml", body);
    const Outcome outcome = run(folder, {"render", scene, "-o", (folder.path() / "x.exr").string()});
    CHECK(outcome.line == "s.toml:1:1: " + line);
    CHECK(outcome.status == 66);
    CHECK_FALSE(std::filesystem::exists(folder.path() / "x.exr"));
}

void check_scene(const std::string& text, const std::string& line) {
    const TempFolder folder;
    folder.write("m.obj", triangle);
    const auto scene = folder.write("s.toml", text);
    const Outcome outcome = run(folder, {"render", scene, "-o", (folder.path() / "x.exr").string()});
    CHECK(outcome.line == line);
    CHECK(outcome.status == 78);
    CHECK_FALSE(std::filesystem::exists(folder.path() / "x.exr"));
}

void check_config(const std::string& text, const std::string& line) {
    const TempFolder folder;
    folder.write("m.obj", triangle);
    folder.write("s.toml", body);
    const auto config = folder.write("c.toml", text);
    for (const std::string verb : {"check", "capture"}) {
        std::vector<std::string> arguments{verb, config};
        if (verb == "capture") arguments.insert(arguments.end(), {"-o", (folder.path() / "out").string()});
        const Outcome outcome = run(folder, arguments);
        CHECK(outcome.line == line);
        CHECK(outcome.status == 78);
    }
    CHECK_FALSE(std::filesystem::exists(folder.path() / "out"));
}

void check_usage(const std::vector<std::string>& arguments, const std::string& line) {
    const TempFolder folder;
    const Outcome outcome = run(folder, arguments);
    CHECK(outcome.line == line);
    CHECK(outcome.status == 64);
}

} // namespace

TEST_CASE("broken meshes: exit 66") {
    check_mesh("", "m.obj: no triangles: a mesh needs at least one face");
    check_mesh("v 0 0\n", "m.obj:1: vertex with fewer than three coordinates");
    check_mesh("v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
               "m.obj:1: coordinate 'nan' is not finite: allowed are numbers up to 3.4e38 m");
    check_mesh("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n",
               "m.obj:4: vertex index 4 out of range: allowed 1 to 3");
    check_mesh("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 x\n", "m.obj:4: 'x' is not a vertex index");
    check_mesh("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", "m.obj:4: face with 2 vertices: at least 3");
    check_mesh("v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n",
               "m.obj: every triangle has zero area: nothing could be seen");
    check_mesh("v 0 0 0\nv 1 0 0\nv 0 1 0\n", "m.obj: no triangles: a mesh needs at least one face");
    check_mesh("v \x1b[31m 0 0\n", "m.obj:1: '\\x1B[31m' is not a coordinate: a decimal number is wanted");
    check_mesh("\x7f"
               "ELF\x02\x01\x01",
               "m.obj: no triangles: a mesh needs at least one face");
}

TEST_CASE("impossible bodies: NaN poses, zero size, circles of parents, textures and materials that are not "
          "there") {
    const std::string ball =
        "[[body]]\nname = \"a\"\nshape = \"ellipsoid\"\nradii_m = [1, 1, 1]\nalbedo = 0.5\n";
    check_scene(ball + "position_m = [nan, 0, 0]\n",
                "s.toml:6:15: body[0].position_m: nan is not a finite number");
    check_scene(ball + "orientation = [0, 0, 0, 0]\n",
                "s.toml:6:15: body[0].orientation: |q| = 0, a unit quaternion [w, x, y, z] is wanted");
    check_scene("[[body]]\nshape = \"box\"\nsize_m = [1, 0, 1]\nalbedo = 0.5\n",
                "s.toml:3:14: body[0].size_m: 0 is out of range, allowed 1e-6 to 1e12 m");
    check_scene("[[body]]\nshape = \"disc\"\nradius_m = 1\ninner_radius_m = 1\nalbedo = 0.5\n",
                "s.toml:4:18: body[0].inner_radius_m: 1 m: allowed is less than the outer radius, 1 m");
    check_scene(ball + "parent = \"a\"\n", "s.toml:1:1: body 'a': parents go in a circle: a -> a");
    check_scene(ball + "parent = \"b\"\n", "s.toml:1:1: body 'a': its parent 'b' is no body of the scene");
    check_scene(ball + "albedo_texture = \"t.png\"\n",
                "s.toml:6:18: body[0].albedo_texture: t.png: no such file");
    check_scene("[[body]]\nshape = \"mesh\"\nfile = \"m.obj\"\n",
                "s.toml:1:1: body 'body0': m.obj brings no materials: the body needs one");
    const TempFolder folder;
    folder.write("t.png", "no picture");
    folder.write("t.mtl", "newmtl m\nmap_Kd gone.png\n");
    folder.write("m.obj", "mtllib t.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n");
    Outcome outcome = run(folder, {"render", folder.write("s.toml", ball + "albedo_texture = \"t.png\"\n"),
                                   "-o", (folder.path() / "x.exr").string()});
    CHECK(outcome.line == "s.toml:1:1: t.png: not an image of a supported format, allowed are FITS, PNG, "
                          "TIFF, JPEG, OpenEXR and PDS3 "
                          "(an image with a detached label: give the label)");
    CHECK(outcome.status == 66);
    outcome = run(folder, {"render", folder.write("s.toml", "[[body]]\nshape = \"mesh\"\nfile = \"m.obj\"\n"),
                           "-o", (folder.path() / "x.exr").string()});
    CHECK(outcome.line == "s.toml:1:1: gone.png: cannot be opened: No such file or directory");
    CHECK(outcome.status == 66);
    CHECK_FALSE(std::filesystem::exists(folder.path() / "x.exr"));
}

TEST_CASE("broken scenes: exit 78") {
    check_scene(
        "[[body]]\nshape = \"sphere\"\nalbedo = 0.5\n",
        "s.toml:2:9: body[0].shape: \"sphere\" is not known, allowed ellipsoid, mesh, planet, terrain, "
        "procedural, polygons, box, disc, cone, model");
    check_scene("[[body]]\nshape = \"mesh\"\nfile = \"n.obj\"\nalbedo = 0.5\n",
                "s.toml:3:8: body[0].file: n.obj: no such file");
    check_scene("[[body]]\nshape = \"ellipsoid\"\nradii_m = [1, -1, 1]\nalbedo = 0.5\n",
                "s.toml:3:15: body[0].radii_m: -1 is out of range, allowed 1e-6 to 1e12 m");
    check_scene(std::string(body) + "trajectory = \"t.csv\"\n",
                "s.toml:5:14: body[0].trajectory: t.csv: no such file");
    check_scene(std::string(body) + "trajectory = \"m.obj\"\n",
                "m.obj:1:1: header is \"v 0 0 0\", allowed \"time_s,x_m,y_m,z_m[,qw][,qx][,qy][,qz]\"");
    check_scene("[camera]\npostion_m = [0, 0, 0]\n",
                "s.toml:2:1: camera.postion_m: unknown key, did you mean \"position_m\"?");
    check_scene("[sun]\ndistance_au = \"far\"\n",
                "s.toml:2:15: sun.distance_au: is a string, allowed a number, 0.005 to 1000 au");
}

TEST_CASE("broken configurations: exit 78") {
    check_config("[scene]\nfile = \"s.toml\"\n[trigger]\nrate_hz = -5\n",
                 "c.toml:4:11: trigger.rate_hz: -5 is out of range, allowed 0.001 to 10000 Hz");
    check_config("[scene]\nfile = \"s.toml\"\n[gige]\nport = \"3956\"\n",
                 "c.toml:4:8: gige.port: is a string, allowed an integer, 1 to 65535");
    check_config("[scene]\nfile = \"t.toml\"\n", "c.toml:2:8: scene.file: t.toml: no such file");
    check_config("[scene]\nfile = \"c.toml\"\n",
                 "c.toml: is a configuration, by its table [scene]; a scene is wanted. obscura capture makes "
                 "what the camera of a configuration would see");
    check_config("[scene]\nfile = 's.toml'\nfile = 's.toml'\n",
                 "c.toml:3:8: not valid TOML: Error while parsing key-value pair: cannot redefine existing "
                 "string 'file'");
    check_config("[scene]\nfile = \"s.toml\"\n[sensor.readout]\nwidht = 5\n",
                 "c.toml:4:1: sensor.readout.widht: unknown key, did you mean \"width\"?");
}

TEST_CASE("bad command lines: exit 64") {
    check_usage({}, "obscura: a verb is missing (try: obscura --help)");
    check_usage({"rendr"}, "obscura: unknown verb \"rendr\", did you mean \"render\"? (try: obscura --help)");
    check_usage({"render"}, "obscura render: SCENE is missing (try: obscura render --help)");
    check_usage({"render", "s.toml"}, "obscura render: --output is missing (try: obscura render --help)");
    check_usage({"render", "s.toml", "-o", "x.jpg"},
                "obscura render: --output x.jpg: the name must end in .exr, .fits or .png");
    check_usage({"render", "s.toml", "-o", "x.png", "--size", "640"},
                "--size: \"640\" is not WIDTHxHEIGHT, for example 640x512; each 1 to 65536");
    check_usage(
        {"render", "s.toml", "-o", "x.png", "--samples", "0"},
        "obscura render: --samples: \"0\" is not allowed, allowed 1 to 65536 (try: obscura render --help)");
    check_usage({"render", "s.toml", "-o", "x.png", "--sampels", "3"},
                "obscura render: unknown option \"--sampels\", did you mean \"--samples\"? (try: obscura "
                "render --help)");
    check_usage(
        {"grab", "--frames", "many"},
        "obscura grab: --frames: \"many\" is not allowed, allowed 1 to 1e+09 (try: obscura grab --help)");
    check_usage(
        {"grab", "--format", "jpeg"},
        "obscura grab: --format: \"jpeg\" is not known, allowed png, fits, raw (try: obscura grab --help)");
    check_usage({"grab", "--rate", "5", "--software-trigger-rate", "5"},
                "obscura grab: --rate and --software-trigger-rate exclude each other");
}

TEST_CASE("outputs that cannot be created: exit 73, before anything is computed") {
    const TempFolder folder;
    const std::string scene = OBSCURA_SOURCE_DIR "/config/scenes/demo.toml";
    const std::string config = OBSCURA_SOURCE_DIR "/config/demo.toml";
    Outcome outcome = run(folder, {"render", scene, "-o", (folder.path() / "no" / "x.exr").string()});
    CHECK(outcome.line == "no: no such directory");
    CHECK(outcome.status == 73);
    // procfs refuses new files even to root.
    outcome = run(folder, {"render", scene, "-o", "/proc/self/x.exr"});
    CHECK(outcome.line == "/proc/self: cannot be written: No such file or directory");
    CHECK(outcome.status == 73);
    outcome = run(folder, {"capture", config, "-o", folder.write("file", "").string()});
    CHECK(outcome.line == "file: not a directory");
    CHECK(outcome.status == 73);
    outcome = run(folder, {"grab", "-o", "/proc/self/frames"});
    CHECK(outcome.line == "/proc/self/frames: cannot be created: No such file or directory");
    CHECK(outcome.status == 73);
}

TEST_CASE("no camera there: exit 69") {
    const TempFolder folder;
    // A loopback address that no other test uses.
    const Outcome outcome = run(folder, {"grab", "--address", "127.255.254.253", "--frames", "1"});
    CHECK(outcome.line.substr(0, 65) == "127.255.254.253: no GigE Vision camera answers on UDP port 3956: ");
    CHECK(outcome.status == 69);
}

} // namespace bad_input_test
