// SPDX-License-Identifier: Apache-2.0
// The scenario of scenario_test.py in C++. Usage: scenario ADDRESS
#include "clients/c/src/sha256.h"

#include <obscura_client.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <numeric>
#include <string>

using namespace obscura;

namespace {

void show_digest(const char* name, const void* data, std::size_t bytes) {
    sha256 digest = sha256_begin();
    char hex[65];
    sha256_add(&digest, data, bytes);
    sha256_end(&digest, hex);
    std::printf("%s %s\n", name, hex);
}

void show(const client::Picture& picture) {
    const auto values = picture.arrays().front(), depth = picture["depth_m"];
    show_digest("values", values.data(), values.bytes());
    show_digest("depth", depth.data(), depth.bytes());
    std::printf("lit %td\n",
                std::count_if(values.begin(), values.end(), [](float value) { return value > 0; }));
    std::printf("seen %td\n",
                std::count_if(depth.begin(), depth.end(), [](float value) { return !std::isnan(value); }));
}

void run(const std::string& address) {
    auto camera = client::connect(address);
    camera.load_scene({});
    camera.set("camera", {{"width", 160},
                          {"height", 120},
                          {"focal_length_mm", 10.0},
                          {"pixel_pitch_um", 20.0},
                          {"boresight", {0, 0, 1}},
                          {"up", {0, -1, 0}},
                          {"psf_sigma_px", 1.5}});
    camera.set("sun", {{"direction", {-1.0, -0.5, -2.0}}});
    camera.add("body", {{"name", "ball"},
                        {"shape", "ellipsoid"},
                        {"radii_m", {1.0, 1.0, 1.0}},
                        {"albedo", 0.3},
                        {"position_m", {0.25, -0.125, 12.5}}});
    client::RenderOptions options;
    options.samples = 16;
    options.seed = 7;
    options.frame = 3;
    options.layers = {"depth_m"};
    show(camera.render(options));
    try {
        camera.set("body", "ball", {{"albedo", 2.5}});
    } catch (const client::RequestError& error) {
        std::printf("refused %s %s %s\n", error.code.c_str(), error.field.c_str(), error.allowed.c_str());
    }
    camera.set("body", "ball", {{"position_m", {0.1, 0.2, 10.0}}});
    camera.set("camera", {{"psf_sigma_px", nullptr}});
    options.time_s = 1.5;
    options.frame = 4;
    show(camera.render(options));
    const auto exposed = camera.call(
        "render", {{"exposure_s", 0.02},
                   {"sensor", client::Map{{"file", "generic"},
                                          {"readout", client::Map{{"width", 96}, {"height", 64}}}}},
                   {"samples", 2},
                   {"seed", 7},
                   {"frame", 5},
                   {"run", 3}});
    const client::Array numbers = exposed["dn"];
    show_digest("dn", numbers.data(), numbers.bytes());
    const auto* const first = static_cast<const std::uint16_t*>(numbers.data());
    std::printf("sum %ld\n", std::accumulate(first, first + numbers.size(), 0L));
    const std::string text = camera.export_toml();
    show_digest("export", text.data(), text.size());
}

} // namespace

int main(int argc, char* argv[]) {
    try {
        run(argc > 1 ? argv[1] : "");
    } catch (const std::exception& error) {
        std::fprintf(stderr, "scenario: %s\n", error.what());
        return 1;
    }
}
