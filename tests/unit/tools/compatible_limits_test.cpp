// SPDX-License-Identifier: Apache-2.0
// What a published client may hold, and pictures of which only parts are rendered.
#include "serve/compatible/handlers.hpp"
#include "serve/compatible/micro_tasks.hpp"
#include "serve/compatible/session_folder.hpp"
#include "tests/unit/tools/compatible_client.hpp"

#include <algorithm>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace compatible_limits_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinRel;
using serve::compatible::windows_of;

namespace {

/// A ball that covers a part of the picture, with stars behind it and a PSF.
void show_ball(Client& client, std::int32_t width, std::int32_t height) {
    client.sun(6.957e8, {0, 0, au_m}, pi * au_m * au_m);
    client.ball("ball", 1, {0.4, 0.2, -10});
    client.size(width, height);
    client.fov_deg(20, 15);
    client.samples(8);
    client.call("loadPSFModel", {{"filename", "gaussian.psf"},
                                 {"parameters", Fields{{"sigma", 0.8}, {"sigma_radius", 4.0}}}});
    client.write("sky.txt", "2\n0.05 0.03 -1 1e-3 1e-3 1e-3 1e-3\n-0.1 -0.06 -1 2e-3 1e-3 5e-4 1e-3\n");
    client.call("setBackground", {{"background", "sky.txt"}});
}

/// Those of the tasks whose pixel `chosen` says.
template<typename Chosen>
List tasks_of(const List& tasks, const Chosen& chosen) {
    List some;
    for (const Value& task : tasks) {
        const List& row = *task.as<List>();
        if (chosen(static_cast<int>(*row[1].as<double>()), static_cast<int>(*row[2].as<double>())))
            some.push_back(task);
    }
    return some;
}

} // namespace

TEST_CASE("a picture and its maps are counted, and given back", "[serve]") {
    Client client;
    client.ball("ball", 1, {0, 0, -10});
    client.size(64, 32);
    client.samples(1);
    client.call("render");
    constexpr std::uint64_t pixels = 64 * 32;
    CHECK(client.memory.used() == pixels * 16);
    {
        const Reply reply = client.call("getImage");
        CHECK(client.memory.used() == pixels * 32);
    }
    (void)client.call("getDepthMap");
    CHECK(client.memory.used() == pixels * (16 + 20));
    client.call("reset");
    CHECK(client.memory.used() == 0);
}

TEST_CASE("a picture for which there is no memory is refused, and the session goes on", "[serve]") {
    Client client;
    client.ball("ball", 1, {0, 0, -10});
    client.samples(1);
    client.size(8192, 8192);
    client.refuse("render", {}, "that clients hold, allowed 268435456 in all");
    client.size(16, 16);
    client.call("render");
    const auto other = client.memory.take((std::uint64_t{256} << 20) - 16 * 16 * 16 - 300);
    client.refuse("getImage", {}, "that clients hold");
    CHECK(client.numbers<std::uint8_t>("getImageGray8").size() == 16 * 16);
}

TEST_CASE("files of a scene have a limit, and what is removed makes room", "[serve]") {
    serve::compatible::SessionFolder folder(1000);
    const std::string first = folder.write(".a", std::string(600, 'a'));
    CHECK_THROWS_WITH(folder.write(".b", std::string(600, 'b')),
                      ContainsSubstring("600 bytes beside 600") && ContainsSubstring("allowed 1000 in all"));
    CHECK_THROWS_WITH(folder.count(first, 1001), ContainsSubstring("allowed 1000"));
    folder.remove(first);
    CHECK_NOTHROW(folder.write(".b", std::string(1000, 'b')));
    folder.clear();
    CHECK(std::filesystem::is_empty(folder.path()));
    CHECK_NOTHROW(folder.write(".c", std::string(1000, 'c')));
}

TEST_CASE("windows cover the pixels of some weight, once each", "[serve]") {
    std::mt19937 random(3);
    for (const unsigned sparse : {1U, 2U, 10U, 200U}) {
        constexpr std::int32_t width = 70, height = 40;
        std::vector<float> weights(width * height);
        for (float& weight : weights)
            weight = random() % sparse == 0 ? 0.5F : 0.0F;
        std::vector<int> covered(weights.size());
        for (const Region& window : windows_of(weights, width)) {
            REQUIRE(window.inside({0, 0, width, height}));
            for (std::int32_t y = window.y; y < window.y + window.height; ++y)
                for (std::int32_t x = window.x; x < window.x + window.width; ++x)
                    ++covered[static_cast<std::size_t>(y * width + x)];
        }
        for (std::size_t i = 0; i < weights.size(); ++i)
            REQUIRE((weights[i] > 0 ? covered[i] == 1 : covered[i] <= 1));
    }
    // A block of rows and columns is one window.
    std::vector<float> block(100 * 50);
    for (std::size_t y = 10; y < 20; ++y)
        std::fill_n(block.begin() + static_cast<std::ptrdiff_t>(100 * y + 30), 16, 1.0F);
    CHECK(windows_of(block, 100) == std::vector<Region>{{30, 10, 16, 10}});
    CHECK(windows_of(std::vector<float>(100), 10).empty());
}

TEST_CASE("micro tasks render their pixels to the bytes of the whole picture", "[serve]") {
    Client client;
    show_ball(client, 96, 64);
    client.call("render");
    const std::vector<float> whole = client.numbers("getImage");
    const List tasks = numbers_of(client.ask("generateMicroTasks", "utasks"));
    REQUIRE(tasks.size() == 96 * 64);
    std::mt19937 random(11);
    std::vector<bool> chosen(tasks.size());
    for (std::size_t i = 0; i < chosen.size(); ++i)
        chosen[i] = random() % 40 == 0 || (i % 96 >= 50 && i % 96 < 66 && i / 96 >= 20);
    const auto at = [](int x, int y) { return static_cast<std::size_t>(y * 96 + x); };
    std::vector<float> sum(whole.size());
    for (const bool first : {true, false}) {
        client.call("renderMicroTasks",
                    {{"utasks", tasks_of(tasks, [&](int x, int y) { return chosen[at(x, y)] == first; })}});
        const std::vector<float> part = client.numbers("getImage");
        for (std::size_t i = 0; i < sum.size(); ++i) {
            // Bottom row first.
            const std::size_t pixel = (63 - i / 4 / 96) * 96 + i / 4 % 96;
            if (chosen[pixel] != first) REQUIRE(part[i] == 0.0F);
            sum[i] += part[i];
        }
    }
    CHECK(sum == whole);
}

TEST_CASE("a part of a picture costs its part of the rays", "[serve]") {
    Client client;
    serve::compatible::CompatibleSettings settings;
    settings.root = client.folder.path();
    serve::compatible::ClientState client_state(settings, client.memory);
    Unhurried work;
    serve::compatible::Object ball;
    ball.keys = {
        {"shape", "ellipsoid"}, {"radii_m", {5.0, 5.0, 5.0}}, {"material", "lambert"}, {"albedo", 1.0}};
    ball.placement.position_m = {0, 0, -10};
    client_state.objects["ball"] = ball;
    client_state.camera.width = client_state.camera.height = 64;
    const auto rays = [&](const std::vector<Region>& windows) {
        const std::uint64_t before = client_state.picture ? client_state.rays_traced() : 0;
        client_state.render(windows, work);
        return static_cast<double>(client_state.rays_traced() - before);
    };
    // The ball fills the picture, with as many rays for each pixel.
    const double all = rays({{0, 0, 64, 64}});
    CHECK_THAT(rays({{0, 0, 16, 16}}) / all, WithinRel(1.0 / 16, 0.05));
    CHECK_THAT(rays({{0, 0, 16, 16}, {32, 16, 32, 32}}) / all, WithinRel(5.0 / 16, 0.05));
    CHECK(rays({}) == 0);
}

} // namespace compatible_limits_test
