// SPDX-License-Identifier: Apache-2.0
// Frames with levels, of the real renderer on a machine of known speed: what their record says is what they
// are.
#include "tests/support/catch.hpp"
#include "tests/unit/emulator/adaptive_rig.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

namespace adaptive_frame_test {

using namespace obscura;
using namespace obscura::emulator;
using namespace obscura::test;

namespace {

/// What full rendering of a frame takes.
std::int64_t cost_of(Rig& rig) {
    const Time begin = rig.clock.now();
    static_cast<void>(rig.full(1));
    return rig.clock.now() - begin;
}

double error_of(const std::vector<float>& image, const std::vector<float>& truth) {
    double error2 = 0, light2 = 0;
    for (std::size_t i = 0; i < image.size(); ++i) {
        error2 += std::pow(static_cast<double>(image[i]) - static_cast<double>(truth[i]), 2);
        light2 += std::pow(static_cast<double>(truth[i]), 2);
    }
    return std::sqrt(error2 / light2);
}

std::vector<float> truth_of(const scene::Scene& scene) {
    const renderer::Renderer reference(scene, {256, 2, 77});
    return render_window(reference, {0, 0, size, size});
}

} // namespace

TEST_CASE("frames that have time are those without levels, byte for byte, and say so") {
    Rig rig(level_asteroid());
    const std::int64_t cost_ns = cost_of(rig);
    for (std::uint64_t id = 1; id <= 5; ++id) {
        const Shot shot = rig.shot(id, 5 * cost_ns);
        CHECK((shot.image == rig.full(id)));
        const FrameQuality& q = shot.quality;
        CHECK(q.level_max == QualityLevel::full);
        CHECK(q.groups == size / quality_group_rows);
        CHECK(q.level_share[0] == 1);
        CHECK(q.rows_degraded == 0);
        CHECK(q.reasons == 0);
        CHECK(q.unknown_share == 0);
        CHECK(q.instants == 1);
        CHECK(q.samples_min >= 1);
        CHECK(q.samples_median >= q.samples_min);
        CHECK(q.spent_us > 0);
        CHECK(q.margin_us > 0);
        CHECK(q.budget_us >= q.spent_us + q.margin_us);
    }
}

TEST_CASE("a frame is called degraded if it differs from the full one, and its levels give it again") {
    Rig rig(level_asteroid());
    Rig other(level_asteroid(), 0, 2);
    const std::int64_t cost_ns = cost_of(rig);
    int degraded = 0, full = 0, mixed = 0;
    std::uint64_t id = 0;
    for (const double budget : {0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 0.9, 1.0, 1.2, 1.6, 3.0})
        for (int f = 0; f < 8; ++f) {
            const auto budget_ns = static_cast<std::int64_t>(budget * static_cast<double>(cost_ns));
            const Shot shot = rig.shot(++id, budget_ns);
            const std::vector<float> whole = rig.full(id);
            INFO("budget " << budget << " of full rendering, frame " << f);
            CHECK((shot.image != whole) == (shot.quality.level_max != QualityLevel::full));
            CHECK((shot.quality.level_max == QualityLevel::full) == (shot.quality.reasons == 0));
            CHECK((other.again(id, shot.quality) == shot.image));
            std::int32_t rows = 0;
            bool same = true;
            for (std::int32_t y = 0; y < size; ++y) {
                if (shot.quality.level_of_row(y) != QualityLevel::full) {
                    ++rows;
                    continue;
                }
                const auto first = static_cast<std::ptrdiff_t>(y) * size;
                same = same && std::equal(whole.begin() + first, whole.begin() + first + size,
                                          shot.image.begin() + first);
            }
            CHECK(same);
            CHECK(rows == shot.quality.rows_degraded);
            // Above and below the body no level makes a difference.
            CHECK(shot.quality.level_of_row(0) == QualityLevel::full);
            CHECK(shot.quality.level_of_row(size - 1) == QualityLevel::full);
            ++(rows == 0 ? full : degraded);
            mixed += rows > 0 && shot.quality.level_share[0] > 0.4 ? 1 : 0;
        }
    INFO(full << " full, " << degraded << " degraded, " << mixed << " of them in part");
    CHECK(full >= 10);
    CHECK(degraded >= 30);
    CHECK(mixed >= 5);
}

TEST_CASE("the error of frames falls with the time that they have, and the record knows it") {
    const scene::Scene scene = level_asteroid();
    const std::vector<float> truth = truth_of(scene);
    Rig first(scene);
    const std::int64_t cost_ns = cost_of(first);
    std::vector<double> errors;
    std::uint64_t id = 0;
    for (const double budget : {0.06, 0.12, 0.2, 0.3, 0.45, 0.65, 0.85, 1.1, 1.5, 2.2}) {
        Rig rig(scene);
        const auto budget_ns = static_cast<std::int64_t>(budget * static_cast<double>(cost_ns));
        double error = 0, told = 0, told_ratio = 0;
        struct Sums {
            double light = 0, error2 = 0, lit = 0;
        };
        std::array<Sums, size / quality_group_rows> groups{};
        for (int f = 0; f < 16; ++f) {
            const Shot shot = rig.shot(++id, budget_ns);
            if (f < 8) continue; // costs are not known yet
            error += error_of(shot.image, truth) / 8;
            told += static_cast<double>(shot.quality.error_rms) / 8;
            told_ratio += static_cast<double>(shot.quality.noise_ratio_p95) / 8;
            for (std::size_t i = 0; i < pixels; ++i) {
                if (!(shot.image[i] > 0)) continue;
                Sums& group = groups[i / size / quality_group_rows];
                group.light += static_cast<double>(truth[i]) * electrons_per_j_m2;
                group.error2 += std::pow(
                    (static_cast<double>(shot.image[i]) - static_cast<double>(truth[i])) * electrons_per_j_m2,
                    2);
                ++group.lit;
            }
        }
        // Brute force, from the true errors of the groups.
        std::vector<double> ratios;
        for (const Sums& g : groups)
            if (g.lit > 0) ratios.push_back(std::sqrt(g.error2 / g.lit / (g.light / g.lit + 64)));
        std::sort(ratios.begin(), ratios.end());
        const double ratio = ratios[(19 * ratios.size() - 1) / 20];
        INFO("budget " << budget << ": error " << error << ", estimated " << told << ", over noise " << ratio
                       << ", estimated " << told_ratio);
        CHECK(told / error > 0.8);
        CHECK(told / error < 1.25);
        // Few points meet the edges of the group with most of them: 0.67 at worst.
        CHECK(told_ratio / ratio > (budget > 1 ? 0.7 : 0.6));
        CHECK(told_ratio / ratio < 1.4);
        errors.push_back(error);
    }
    // Spearman's rank correlation of budgets and errors; equal errors share their rank.
    const auto rank = [&](double error) {
        double below = 0;
        for (const double other : errors)
            below += other < error ? 1 : other == error ? 0.5 : 0;
        return below;
    };
    const double mean = static_cast<double>(errors.size()) / 2;
    double both = 0, own2 = 0, place2 = 0;
    for (std::size_t i = 0; i < errors.size(); ++i) {
        const double place = static_cast<double>(i) + 0.5 - mean;
        const double own = rank(errors[i]) - mean;
        both += place * own, own2 += own * own, place2 += place * place;
    }
    INFO("rank correlation " << both / std::sqrt(own2 * place2));
    CHECK(both / std::sqrt(own2 * place2) <= -0.95);
    CHECK(errors.front() > 3 * errors.back());
}

TEST_CASE("motion is sampled at as many instants as the record says") {
    scene::Scene scene = level_asteroid();
    scene.bodies[0].motion.samples = {{-10, {{0, 0, -3000}, {}}}, {10, {{0, 0, 3000}, {}}}};
    Rig rig(scene, 200 * ns_per_ms);
    const std::int64_t cost_ns = cost_of(rig);
    const Shot full = rig.shot(1, 5 * cost_ns);
    CHECK(full.quality.instants >= 8);
    std::uint32_t fewest = full.quality.instants;
    for (std::uint64_t id = 2; id < 20; ++id) {
        const Shot shot = rig.shot(id, cost_ns / 20);
        fewest = std::min(fewest, shot.quality.instants);
        if (shot.quality.level_max >= QualityLevel::grid) CHECK(shot.quality.instants == 1);
    }
    CHECK(fewest == 1);
}

TEST_CASE("a stall is in the record") {
    Rig rig(level_asteroid());
    const std::int64_t cost_ns = cost_of(rig);
    std::uint64_t id = 0;
    for (; id < 10; ++id)
        static_cast<void>(rig.shot(id, cost_ns));
    rig.clock.stall(2 * cost_ns);
    const FrameQuality stalled = rig.shot(++id, cost_ns).quality;
    CHECK((stalled.reasons & quality_stall) != 0);
    CHECK(stalled.rows_degraded > 0);
    CHECK(stalled.margin_us < 0);
}

} // namespace adaptive_frame_test
