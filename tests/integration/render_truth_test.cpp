// SPDX-License-Identifier: Apache-2.0
// `obscura render` as its users run it, its OpenEXR files held against what must come out.
#include "core/geometry.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/data.hpp"
#include "tests/support/temp_folder.hpp"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <fmt/format.h>
#include <zlib.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <string>
#include <vector>

namespace render_truth_test {

using namespace obscura;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double pi = std::numbers::pi;
constexpr double au_m = 149'597'870'700.0;
/// ASTM E490-00a between 400 and 900 nm at 1 au, trapezoidal over the published table.
constexpr double e490_400_900_w_m2 = 758.328;

struct Image {
    int width = 0, height = 0;
    std::vector<float> values;
    [[nodiscard]] double at(int x, int y) const {
        return x < 0 || y < 0 || x >= width || y >= height
                   ? 0.0
                   : static_cast<double>(
                         values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                static_cast<std::size_t>(x)]);
    }
    [[nodiscard]] double sum() const {
        double s = 0;
        for (const float v : values)
            s += static_cast<double>(v);
        return s;
    }
};

/// The irradiance channel of an EXR file, read with OpenEXR itself.
Image read_irradiance(const std::filesystem::path& file) {
    Imf::InputFile in(file.c_str());
    const auto box = in.header().dataWindow();
    Image image{box.max.x - box.min.x + 1, box.max.y - box.min.y + 1, {}};
    image.values.resize(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
    std::string name;
    for (auto c = in.header().channels().begin(); c != in.header().channels().end(); ++c)
        if (std::string(c.name()).rfind("irradiance", 0) == 0) name = c.name();
    REQUIRE_FALSE(name.empty());
    Imf::FrameBuffer buffer;
    buffer.insert(name, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(image.values.data()), sizeof(float),
                                   sizeof(float) * static_cast<std::size_t>(image.width)));
    in.setFrameBuffer(buffer);
    in.readPixels(box.min.y, box.max.y);
    return image;
}

Image render(const std::filesystem::path& folder, const std::string& scene, const std::string& options = "") {
    const auto file = folder / "scene.toml";
    const auto output = folder / "out.exr";
    std::ofstream(file) << scene;
    const std::string command =
        fmt::format("{} render {} --output {} {} 2>{}", OBSCURA_PROGRAM, file.string(), output.string(),
                    options, (folder / "log").string());
    INFO(command);
    REQUIRE(std::system(command.c_str()) == 0);
    return read_irradiance(output);
}

} // namespace

TEST_CASE("the disc-integrated flux of a Lambert sphere follows the phase law") {
    const test::TempFolder folder;
    constexpr double radius = 1000;
    constexpr double distance = 1e8;
    constexpr double albedo = 0.25;
    for (const double phase_deg : {0.0, 30.0, 60.0, 90.0, 120.0, 150.0}) {
        const double phase = phase_deg * pi / 180;
        // 200 pixels across: 1e-7 rad a pixel.
        const Image image =
            render(folder.path(),
                   fmt::format(R"(
[sun]
direction = [{:.17g}, 0, {:.17g}]
distance_au = 1
[camera]
width = 256
height = 256
pixel_pitch_um = 10
focal_length_mm = 100000
aperture_mm = 100
psf_sigma_px = 0
position_m = [0, 0, {}]
boresight = [0, 0, -1]
up = [0, 1, 0]
[[body]]
name = "sphere"
shape = "ellipsoid"
radii_m = [{}, {}, {}]
material = "lambert"
albedo = {}
[[band]]
from_nm = 400
to_nm = 900
)",
                               std::sin(phase), std::cos(phase), distance, radius, radius, radius, albedo),
                   "--samples 64");
        const double law = (std::sin(phase) + (pi - phase) * std::cos(phase)) / pi;
        const double expected = e490_400_900_w_m2 * 2 * albedo / 3 * std::pow(radius / distance, 2) * law;
        INFO("phase " << phase_deg << " deg: ratio " << image.sum() / expected);
        CHECK_THAT(image.sum(), WithinRel(expected, 0.002));
        CHECK(image.at(0, 0) == 0.0);
    }
}

TEST_CASE("real stars stand where the projection puts them") {
    const auto catalogue = test::data_file("stars/kstars_stars.dat.gz");
    if (!catalogue) return;
    const test::TempFolder folder;

    // The catalogue's fixed columns (stars to V 6.5), written as the table the scene reads.
    std::vector<Vec3> directions;
    {
        std::ofstream csv(folder.path() / "stars.csv");
        csv << "ra_deg,dec_deg,v_mag,b_v\n";
        gzFile in = gzopen(catalogue->c_str(), "rb");
        REQUIRE(in != nullptr);
        std::array<char, 512> buffer{};
        while (gzgets(in, buffer.data(), static_cast<int>(buffer.size())) != nullptr) {
            const std::string line = buffer.data();
            if (line.size() < 58 || line[0] == '#') continue;
            const auto number = [&](std::size_t from, std::size_t to) {
                return std::atof(line.substr(from, to - from).c_str());
            };
            const double v = number(46, 51);
            if (v > 6.5) continue;
            const double ra = 15 * (number(0, 2) + number(2, 4) / 60 + number(4, 9) / 3600);
            const double dec =
                (line[10] == '-' ? -1 : 1) * (number(11, 13) + number(13, 15) / 60 + number(15, 19) / 3600);
            csv << fmt::format("{:.8f},{:.8f},{:.2f},{:.2f}\n", ra, dec, v, number(51, 56));
            directions.push_back({std::cos(dec * pi / 180) * std::cos(ra * pi / 180),
                                  std::cos(dec * pi / 180) * std::sin(ra * pi / 180),
                                  std::sin(dec * pi / 180)});
        }
        gzclose(in);
    }
    REQUIRE(directions.size() > 5000);

    constexpr int width = 1024;
    constexpr double focal_px = 35e-3 / 6.9e-6;
    const Vec3 boresight = normalized(Vec3{0.1, 0.99, -0.05});
    const Image image =
        render(folder.path(), fmt::format(R"(
[stars]
catalogue = "stars.csv"
limiting_magnitude = 6.5
[camera]
width = {}
height = {}
pixel_pitch_um = 6.9
focal_length_mm = 35
aperture_mm = 18
psf_sigma_px = 0.8
boresight = [{:.17g}, {:.17g}, {:.17g}]
up = [0, 0, 1]
)",
                                          width, width, boresight.x, boresight.y, boresight.z));

    // Camera axes by hand: z boresight, x right, y down.
    const Vec3 x_axis = normalized(cross(boresight, Vec3{0, 0, 1}));
    const Vec3 y_axis = cross(boresight, x_axis);
    std::vector<std::array<double, 2>> projected;
    for (const Vec3 d : directions) {
        const double z = dot(d, boresight);
        if (z <= 0) continue;
        projected.push_back({(width - 1) / 2.0 + focal_px * dot(d, x_axis) / z,
                             (width - 1) / 2.0 + focal_px * dot(d, y_axis) / z});
    }
    int measured = 0;
    double worst = 0;
    for (const auto& p : projected) {
        if (p[0] < 8 || p[1] < 8 || p[0] > width - 9 || p[1] > width - 9) continue;
        int near = 0;
        for (const auto& q : projected)
            near += std::hypot(p[0] - q[0], p[1] - q[1]) < 16 ? 1 : 0;
        if (near > 1) continue; // another star would pull the centroid
        double sum = 0;
        double sx = 0;
        double sy = 0;
        const int cx = static_cast<int>(std::lround(p[0]));
        const int cy = static_cast<int>(std::lround(p[1]));
        for (int y = cy - 6; y <= cy + 6; ++y)
            for (int x = cx - 6; x <= cx + 6; ++x) {
                sum += image.at(x, y);
                sx += x * image.at(x, y);
                sy += y * image.at(x, y);
            }
        REQUIRE(sum > 0);
        worst = std::fmax(worst, std::hypot(sx / sum - p[0], sy / sum - p[1]));
        ++measured;
    }
    INFO(measured << " stars, worst centroid error " << worst << " px");
    CHECK(measured > 30);
    CHECK(worst < 0.05);
}

} // namespace render_truth_test
