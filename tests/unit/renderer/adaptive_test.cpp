// Adaptive sampling: the error it promises, at fewer samples, with the same bytes for any window.
#include "support.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>

using namespace obscura;
using namespace obscura::test;

namespace {

scene::Scene asteroid() {
    scene::Scene s = sphere_scene(scene::LommelSeeliger{0.2}, 1.0, 60, 160);
    s.bodies[0].shape = scene::ProceduralBody{500, {1, 0.8, 0.7}, 1, 5};
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
        CHECK(error > target / 4); // it does not buy what nobody asked for
        // Deciding by the samples themselves costs some bias where an edge just touches a pixel.
        CHECK(std::abs(image.sum() / truth.sum() - 1) < 2e-3);
        // A fixed number of samples that costs as much is worse.
        const renderer::Renderer fixed(s, {2 * base, 2, 5});
        const Image plain = render(fixed);
        CHECK((rms_error(plain, truth) > error || fixed.samples_taken() > r.samples_taken()));
    }
}

TEST_CASE("Adaptive frames are the same for any threads, bands and window") {
    renderer::RenderSettings settings{2, 1, 5};
    settings.target_error = 0.01;
    const scene::Scene s = asteroid();
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
