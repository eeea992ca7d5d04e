// SPDX-License-Identifier: Apache-2.0
// Camera of received frames: part of the sensor, binning, choice of the lens.
#include "core/error.hpp"
#include "tests/support/catch.hpp"
#include "tools/receive/received_camera.hpp"

#include <nlohmann/json.hpp>

namespace camera_file_test {

using namespace obscura;
using namespace obscura::tools;

namespace {

scene::Camera lens(double focal_length_m) {
    scene::Camera camera;
    camera.width = 200;
    camera.height = 100;
    camera.pixel_pitch_m = 10e-6;
    camera.focal_length_m = focal_length_m;
    camera.distortion.model = scene::Distortion::Model::radial;
    camera.distortion.coefficients = {-0.1};
    return camera;
}

FrameChunks frame(const std::vector<Region>& windows) {
    FrameChunks chunks;
    chunks.truth.intrinsics = lens(0.02).intrinsics();
    for (const Region& window : windows)
        chunks.windows.push_back({.sensor = window});
    return chunks;
}

} // namespace

TEST_CASE("the matrix of binned frames maps the centres of their pixels") {
    ReceivedCamera received;
    received.set_binning({2, 4});
    received.add(frame({{20, 8, 100, 80}}), "a.fits");
    const PictureCamera camera = received.camera({}, 200, 100);
    const auto json = nlohmann::json::parse(camera_file_text(camera, received.frames()));
    CHECK(json["image_width"] == 50);
    CHECK(json["image_height"] == 20);
    const auto& k = json["camera_matrix"]["data"];
    // A direction that falls on the middle of the sensor's pixels (30..31, 12..15) is the middle of the
    // picture's pixel (5, 1).
    const Intrinsics in = lens(0.02).intrinsics();
    const double u = (30.5 - in.principal_point_px[0]) / in.focal_length_px[0],
                 v = (13.5 - in.principal_point_px[1]) / in.focal_length_px[1];
    CHECK_THAT(k[0].get<double>() * u + k[2].get<double>(), Catch::Matchers::WithinAbs(5, 1e-9));
    CHECK_THAT(k[4].get<double>() * v + k[5].get<double>(), Catch::Matchers::WithinAbs(1, 1e-9));
    CHECK_FALSE(json.contains("lens"));
    CHECK_FALSE(json["frames"][0].contains("R"));
}

TEST_CASE("frames of several or of different windows have the principal point of the whole sensor") {
    for (const auto& second : {std::vector<Region>{{0, 0, 50, 50}}, {{20, 8, 100, 80}, {0, 0, 10, 10}}}) {
        ReceivedCamera received;
        received.add(frame({{20, 8, 100, 80}}), "");
        CHECK(received.camera({}, 200, 100).window == Region{20, 8, 100, 80});
        received.add(frame(second), "");
        CHECK(received.camera({}, 200, 100).window == Region{0, 0, 200, 100});
    }
}

TEST_CASE("the lens is the one of the frames' focal length") {
    ReceivedCamera received;
    received.add(frame({{0, 0, 200, 100}}), "");
    const PictureCamera camera = received.camera({lens(0.03), lens(0.02)}, 200, 100);
    REQUIRE(camera.lens);
    CHECK(camera.lens->focal_length_m == 0.02);
    CHECK_THROWS_AS(received.camera({lens(0.03)}, 200, 100), InputError);
    scene::Camera shifted = lens(0.02);
    shifted.principal_offset_px[1] = 0.5;
    CHECK_THROWS_AS(received.camera({shifted}, 200, 100), InputError);
}

} // namespace camera_file_test
