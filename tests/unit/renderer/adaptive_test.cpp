// SPDX-License-Identifier: Apache-2.0
// Adaptive sampling: the error it promises, at fewer samples, with the same bytes for any window.
#include "renderer/materials/lambert.hpp"
#include "renderer/materials/lommel_seeliger.hpp"
#include "renderer/shapes/box.hpp"
#include "renderer/shapes/procedural_body.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <string>

namespace adaptive_test {

using namespace obscura;
using namespace obscura::test;

namespace {

scene::Scene asteroid() {
    scene::Scene s = sphere_scene(renderer::LommelSeeligerParameters{0.2}, 1.0, 60, 160);
    s.bodies[0].shape = renderer::ProceduralBodyParameters{500, {1, 0.8, 0.7}, 1, 5};
    return s;
}

/// Root mean square difference over the lit pixels of `truth`, over the 80th percentile of those.
double rms_error(const Image& image, const Image& truth) {
    std::vector<float> lit;
    double sum = 0;
    for (std::size_t i = 0; i < truth.values.size(); ++i)
        if (truth.values[i] > 0) {
            lit.push_back(truth.values[i]);
            const double d = static_cast<double>(image.values[i]) - static_cast<double>(truth.values[i]);
            sum += d * d;
        }
    const auto level = lit.begin() + static_cast<std::ptrdiff_t>(lit.size() * 8 / 10);
    std::nth_element(lit.begin(), level, lit.end());
    return std::sqrt(sum / static_cast<double>(lit.size())) / static_cast<double>(*level);
}

} // namespace

TEST_CASE("Adaptive sampling keeps the error it was asked for, without bias") {
    const scene::Scene s = asteroid();
    const Image truth = render(renderer::Renderer(s, {256, 2, 77}));
    for (const auto& [target, base] : {std::pair{0.03, 2u}, {0.01, 4u}}) {
        renderer::RenderSettings settings{base, 2, 5};
        settings.target_error = target;
        settings.max_samples_per_pixel = 256;
        const renderer::Renderer r(s, settings);
        const Image image = render(r);
        const double error = rms_error(image, truth);
        INFO("target " << target << " error " << error << " samples " << r.samples_taken());
        CHECK(error < target * 1.1);
        CHECK(error > target / 4); // it does not exceed the request
        // Deciding by the samples themselves costs some bias where an edge just touches a pixel.
        CHECK(std::abs(image.sum() / truth.sum() - 1) < 2e-3);
        // A fixed number of samples that costs as much is worse.
        const renderer::Renderer fixed(s, {2 * base, 2, 5});
        const Image plain = render(fixed);
        CHECK((rms_error(plain, truth) > error || fixed.samples_taken() > r.samples_taken()));
    }
}

TEST_CASE("A real-time frame, one shared ray a pixel and more where it matters, agrees with 1024 samples") {
    scene::Scene s = sphere_scene(renderer::LommelSeeligerParameters{0.2}, 1.0, 300, 672);
    s.bodies[0].shape = renderer::ProceduralBodyParameters{500, {1, 0.9, 0.8}, 3, 6};
    // From the sky over the sunlit limb to the terminator and into the night.
    const Region window{10, 300, 640, 32};
    const auto picture = [&](const renderer::Renderer& r, std::uint64_t frame) {
        return Image{window.width, window.height, render_window(r, window, 16, frame)};
    };
    for (const auto& [sigma_px, samples] : {std::pair{0.5, 1024u}, {0.7, 256u}}) {
        INFO("sigma " << sigma_px);
        s.camera.psf_sigma_px = sigma_px;
        const Image truth = picture(renderer::Renderer(s, {samples, 2, 77}), 1);
        for (const double target : {0.01, 0.03}) {
            INFO("target " << target);
            renderer::RenderSettings settings{2, 2, 5};
            settings.target_error = target;
            const renderer::Renderer r(s, settings);
            double bias = 0;
            for (std::uint64_t frame = 0; frame < 4; ++frame) {
                const Image image = picture(r, frame);
                CHECK(rms_error(image, truth) < target);
                bias += (image.sum() / truth.sum() - 1) / 4;
            }
            CHECK(std::abs(bias) < 5e-4);
            CHECK(r.samples_taken() < 4u * 2 * 640 * 32);
        }
    }
}

TEST_CASE("A picture of nothing but straight edges, in two colours, stays near the error asked for") {
    // Edges along the pixels are the worst for points that lie in rows and columns themselves.
    constexpr std::int32_t size = 64;
    scene::Scene s;
    s.sun.position_m = {0, 0, -astronomical_unit_m};
    s.bands = {{400e-9, 500e-9}, {500e-9, 700e-9}};
    for (int k = -5; k <= 5; ++k) {
        scene::Body bar{"bar" + std::to_string(k),
                        renderer::BoxParameters{{3, 300, 1}},
                        renderer::LambertParameters{0.5},
                        {}};
        bar.motion.samples[0].pose.position_m = {7.3 * k, 0, 1000};
        bar.colour = {0.2, 1.0};
        s.bodies.push_back(bar);
    }
    s.camera.width = s.camera.height = size;
    s.camera.pixel_pitch_m = 10e-6;
    s.camera.focal_length_m = 10e-6 * 1000 / 1.0; // 1 m a pixel
    s.camera.psf_sigma_px = 0.7;
    s.camera.motion.samples[0].pose = {{0, 0, 0}, {1, 0, 0, 0}};
    const std::vector<float> truth = render_window(renderer::Renderer(s, {512, 2, 9}), {0, 0, size, size});
    renderer::RenderSettings settings{2, 2, 5};
    settings.target_error = 0.01;
    const std::vector<float> image = render_window(renderer::Renderer(s, settings), {0, 0, size, size});
    const std::size_t plane = std::size_t{size} * size;
    for (std::size_t band = 0; band < 2; ++band) {
        const auto at = [&](const std::vector<float>& v, std::size_t i) {
            return static_cast<double>(v[band * plane + i]);
        };
        double square = 0;
        double most = 0;
        std::size_t lit = 0;
        for (std::size_t i = 0; i < plane; ++i) {
            if (at(truth, i) <= 0) continue;
            ++lit;
            most = std::max(most, at(truth, i));
            square += (at(image, i) - at(truth, i)) * (at(image, i) - at(truth, i));
        }
        CHECK(lit > plane / 2);
        CHECK(std::sqrt(square / static_cast<double>(lit)) < 0.025 * most);
    }
}

TEST_CASE("Adaptive frames are the same for any threads, bands and window") {
    renderer::RenderSettings settings{2, 1, 5};
    settings.target_error = 0.01;
    scene::Scene s = asteroid();
    s.camera.focal_length_m *= 3; // a large body, whose pixels share rays
    const renderer::Renderer one(s, settings);
    settings.threads = 3;
    const renderer::Renderer three(s, settings);
    const std::vector<float> whole = render_window(one, {0, 0, 160, 160}, 160);
    CHECK(whole == render_window(three, {0, 0, 160, 160}, 19));
    const Region window{53, 65, 77, 91};
    const std::vector<float> part = render_window(three, window, 10);
    std::size_t differing = 0;
    for (int y = 0; y < window.height; ++y)
        for (int x = 0; x < window.width; ++x)
            differing += part[static_cast<std::size_t>(y * window.width + x)] !=
                                 whole[static_cast<std::size_t>((window.y + y) * 160 + window.x + x)]
                             ? 1
                             : 0;
    CHECK(differing == 0);
}

TEST_CASE("Rows of a rolling shutter do not depend on how they are grouped into requests") {
    renderer::RenderSettings settings{2, 2, 5};
    settings.target_error = 0.01;
    scene::Scene s = asteroid();
    s.camera.focal_length_m *= 3; // a large body, whose pixels share rays where rows have one time
    s.bodies[0].motion.spin_axis = {0, 0, 1};
    s.bodies[0].motion.spin_rate_rad_s = 0.1;
    const renderer::Renderer r(s, settings);
    const Region window{40, 40, 64, 48};
    // Pairs of rows are exposed together, as where a sensor reads two at a time; the last rows of a frame
    // have the time of the first ones.
    std::vector<RowTime> times;
    for (std::int32_t row = 0; row < window.height; ++row) {
        const Time t{row < 40 ? row / 2 * 1'000'000LL : 0};
        times.push_back({t, t});
    }
    const auto image = [&](std::int32_t rows_each, std::optional<Time> common_mid) {
        std::vector<float> whole;
        for (std::int32_t first = 0; first < window.height; first += rows_each) {
            renderer::RenderRequest request;
            request.window = window;
            request.first_row = first;
            request.rows = std::min(rows_each, window.height - first);
            request.row_times = std::span(times).subspan(static_cast<std::size_t>(first),
                                                         static_cast<std::size_t>(request.rows));
            request.common_mid = common_mid;
            std::vector<float> rows(static_cast<std::size_t>(request.rows * window.width));
            r.render(request, rows);
            whole.insert(whole.end(), rows.begin(), rows.end());
        }
        return whole;
    };
    CHECK(!renderer::common_mid(times));
    const std::vector<float> together = image(window.height, {});
    for (const std::int32_t rows : {1, 2, 3, 7, 20}) {
        INFO(rows << " rows each");
        const bool same = image(rows, {}) == together;
        CHECK(same);
    }
    // Also if the caller states a time that only some of the rows have.
    const std::vector<float> some_shared = image(window.height, Time{});
    const bool shares = some_shared != together;
    CHECK(shares);
    for (const std::int32_t rows : {1, 2, 3, 7, 20}) {
        INFO(rows << " rows each");
        const bool same = image(rows, Time{}) == some_shared;
        CHECK(same);
    }
}

TEST_CASE("The error asked for is relative to the lit body's radiance, whichever way light is traced") {
    scene::Scene s = asteroid();
    renderer::RenderSettings settings{4, 2, 5};
    settings.target_error = 0.01;
    settings.max_samples_per_pixel = 256;
    const auto samples = [&](const scene::Scene& scene) {
        const renderer::Renderer r(scene, settings);
        render(r);
        return static_cast<double>(r.samples_taken());
    };
    const double direct = samples(s);
    // A body with a colour is left to the path tracer, whose pixels are in W/m2.
    for (const double scale : {1e-4, 1.0, 1e4}) {
        INFO("Sun " << scale);
        s.bodies[0].colour = {1};
        s.sun.irradiance_scale = scale;
        CHECK(std::abs(samples(s) / direct - 1) < 0.02);
        s.bodies[0].colour = {0.1};
        CHECK(std::abs(samples(s) / direct - 1) < 0.02);
    }
}

} // namespace adaptive_test
