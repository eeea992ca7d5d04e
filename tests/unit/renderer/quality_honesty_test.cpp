// SPDX-License-Identifier: Apache-2.0
// Honesty of the estimated error at each quality level: against images of many samples.
#include "honesty_subjects.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace quality_honesty_test {

using namespace obscura;
using namespace obscura::test;

namespace {

constexpr int frames = 16;

struct Planes {
    std::vector<double> mean; ///< over the bands
    std::vector<float> variance;
};

Planes frame(const renderer::Renderer& r, const Region& window, QualityLevel level, std::uint64_t id) {
    const auto rows = static_cast<std::size_t>(window.height);
    const std::size_t plane = static_cast<std::size_t>(window.width) * rows;
    const std::vector<RowTime> times(rows);
    std::vector<QualityLevel> levels;
    for (std::size_t y = 0; y < rows; ++y)
        levels.push_back(level);
    Planes out{std::vector<double>(plane), std::vector<float>(plane)};
    renderer::RenderRequest request;
    request.window = window;
    request.rows = window.height;
    request.row_times = times;
    request.common_mid = renderer::common_mid(times);
    request.frame_id = id;
    request.levels = levels;
    request.frame_times = times;
    request.frame_y = window.y;
    request.variance = out.variance;
    std::vector<float> image(plane * r.band_count());
    r.render(request, image);
    for (std::size_t i = 0; i < image.size(); ++i)
        out.mean[i % plane] += static_cast<double>(image[i]) / static_cast<double>(r.band_count());
    return out;
}

/// What a level does to a scene.
struct LevelFigures {
    double error = 0; ///< rms over rms of the image
    double ratio = 0; ///< estimated over true error
    double steep = 0; ///< the same of the 5 % of lit pixels that differ most from their neighbours
    double rays = 0;  ///< per pixel
    std::size_t zeros = 0;
};

LevelFigures figures_of(const Subject& subject, const renderer::Renderer& r, QualityLevel level,
                        const std::vector<double>& truth) {
    const auto width = static_cast<std::size_t>(subject.window.width);
    std::vector<double> slope(truth.size());
    std::vector<double> sorted;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        const double right = i % width + 1 < width ? std::abs(truth[i] - truth[i + 1]) : 0;
        const double down = i + width < truth.size() ? std::abs(truth[i] - truth[i + width]) : 0;
        slope[i] = std::max(right, down);
        if (truth[i] > 0) sorted.push_back(slope[i]);
    }
    const auto steep = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() * 95 / 100);
    std::nth_element(sorted.begin(), steep, sorted.end());
    LevelFigures out;
    double light2 = 0, error2[2] = {}, told2[2] = {};
    const std::uint64_t rays = r.rays_traced();
    for (int f = 0; f < frames; ++f) {
        const Planes p = frame(r, subject.window, level, static_cast<std::uint64_t>(f));
        for (std::size_t i = 0; i < truth.size(); ++i) {
            const double error = std::pow(p.mean[i] - truth[i], 2);
            light2 += truth[i] * truth[i];
            error2[0] += error;
            told2[0] += static_cast<double>(p.variance[i]);
            out.zeros += p.mean[i] > 0 && !(p.variance[i] > 0) ? 1 : 0;
            if (slope[i] < *steep) continue;
            error2[1] += error;
            told2[1] += static_cast<double>(p.variance[i]);
        }
    }
    out.error = std::sqrt(error2[0] / light2);
    out.ratio = std::sqrt(told2[0] / error2[0]);
    out.steep = std::sqrt(told2[1] / error2[1]);
    out.rays = static_cast<double>(r.rays_traced() - rays) / frames / static_cast<double>(truth.size());
    return out;
}

} // namespace

TEST_CASE("the estimated error of a level is that of its image") {
    for (const Subject& subject : {asteroid(), limb(), cornell(), planetshine(100)}) {
        renderer::RenderSettings settings{2, 2, 5};
        settings.target_error = subject.name == "cornell" ? 0.15 : 0.02;
        const renderer::Renderer r(subject.scene, settings);
        const renderer::Renderer reference(subject.scene, {subject.name == "cornell" ? 2048U : 512U, 2, 77});
        const std::vector<double> truth = frame(reference, subject.window, QualityLevel::full, 1).mean;
        for (const QualityLevel level :
             {QualityLevel::full, QualityLevel::goal, QualityLevel::bounces, QualityLevel::grid,
              QualityLevel::quarter, QualityLevel::sixteenth}) {
            if (level != QualityLevel::full && !r.has_level(level)) continue;
            const LevelFigures f = figures_of(subject, r, level, truth);
            INFO(subject.name << ", " << name_of(level) << ": error " << f.error << ", rays a pixel "
                              << f.rays);
            INFO("estimated over true " << f.ratio << ", where it is steepest " << f.steep);
            CHECK(f.zeros == 0);
            if (is_biased(level)) { // what is left out cannot be estimated from what is there
                CHECK(f.ratio < 0.8);
                continue;
            }
            // Few samples of a box of many reflections do not meet its rarest paths, and end where they did
            // not: as many as the pixels' own estimates ask for.
            CHECK(f.ratio > (subject.name == "cornell" && level == QualityLevel::goal ? 0.65 : 0.8));
            CHECK(f.ratio < 1.25);
            CHECK(f.steep > (subject.name == "cornell" ? 0.6 : 0.7));
            CHECK(f.steep < 1.5);
        }
    }
}

} // namespace quality_honesty_test
