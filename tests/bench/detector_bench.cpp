// SPDX-License-Identifier: Apache-2.0
// How long the detector takes for a frame, beside a loop over the standard library's generators. JSON.
#include "sensors/fixed_pattern.hpp"
#include "sensors/sensor.hpp"
#include "sensors/sensor_file.hpp"

#include <fmt/format.h>
#include <hwy/targets.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <random>
#include <string>
#include <vector>

using namespace obscura;
using namespace obscura::sensors;

namespace {

/// The best of several runs; CPU time of the thread does not count what other programs took, but on a CPU
/// that is shared by hyperthreads it still grows with their load.
struct Took {
    double wall_ms = 1e300, cpu_ms = 1e300;
};

double cpu_ms() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

template<class Work>
Took best_of(int repeats, Work work) {
    Took best;
    for (int i = 0; i < repeats; ++i) {
        const auto begin = std::chrono::steady_clock::now();
        const double cpu = cpu_ms();
        work(i);
        best.cpu_ms = std::min(best.cpu_ms, cpu_ms() - cpu);
        best.wall_ms = std::min(
            best.wall_ms,
            std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
    }
    return best;
}

const SpectralBand band{500e-9, 600e-9};
constexpr double aperture_m = 0.02;

struct Case {
    ReadoutPlan plan;
    std::vector<float> light;
    std::vector<std::uint16_t> dn;
};

Case make(const SensorDescription& d, const Detector& detector, std::vector<WindowRequest> windows,
          double electrons) {
    Case c;
    if (const std::string why = plan_readout(d.readout, windows, Time{}, c.plan); !why.empty()) {
        fmt::print(stderr, "{}\n", why);
        std::exit(1);
    }
    const auto pixels = static_cast<std::size_t>(c.plan.width) * static_cast<std::size_t>(c.plan.height);
    const double seconds = to_seconds(c.plan.rows[0].exposure_ns());
    c.light.assign(pixels, static_cast<float>(electrons / seconds / detector.electrons_per_s_per_w_m2()[0]));
    c.dn.resize(pixels);
    return c;
}

Took measure(const Detector& detector, Case& c, int repeats) {
    const IrradianceBand light{0, c.plan.height, c.plan.width, c.light};
    return best_of(repeats,
                   [&](int i) { detector.expose(c.plan, light, static_cast<std::uint64_t>(i), 0, c.dn); });
}

// The same physics by the standard library: one Poisson and one normal number per pixel.
Took standard(const SensorDescription& d, double mean) {
    std::mt19937_64 engine(1);
    const auto n = static_cast<std::size_t>(d.readout.width) * static_cast<std::size_t>(d.readout.height);
    std::vector<std::uint16_t> dn(n);
    std::vector<float> means(n, static_cast<float>(mean));
    std::normal_distribution<float> normal;
    return best_of(3, [&](int) {
        for (std::size_t i = 0; i < n; ++i) {
            std::poisson_distribution<int> poisson(static_cast<double>(means[i]));
            const double v = 64 + 0.04 * (poisson(engine) + 55 * static_cast<double>(normal(engine)));
            dn[i] = static_cast<std::uint16_t>(std::clamp(v + 0.5, 0.0, 4095.0));
        }
    });
}

} // namespace

int main(int argc, char** argv) {
    const SensorDescription d =
        sensors::load_sensor(argc > 1 ? argv[1] : OBSCURA_SOURCE_DIR "/config/sensors/has2.toml");
    const Detector detector(d, {&band, 1}, aperture_m, 1);
    const std::int32_t w = d.readout.width, h = d.readout.height;
    const std::int64_t exposure = 66 * ns_per_ms;
    Case dark = make(d, detector, {{{0, 0, w, h}, exposure}}, 0);
    Case flat = make(d, detector, {{{0, 0, w, h}, exposure}}, 20'000);
    std::vector<WindowRequest> windows;
    for (std::int32_t i = 0; i < 20; ++i)
        windows.push_back({{40 * i % (w - 20) / 2 * 2, 48 * i % (h - 20) / 2 * 2, 20, 20}, exposure});
    Case twenty = make(d, detector, windows, 200);
    // Rounds, so that a spell of load does not fall on one case alone.
    Took dark_took, flat_took, twenty_took;
    const auto better = [](Took& best, const Took& took) {
        best.wall_ms = std::min(best.wall_ms, took.wall_ms);
        best.cpu_ms = std::min(best.cpu_ms, took.cpu_ms);
    };
    for (int round = 0; round < 10; ++round) {
        better(dark_took, measure(detector, dark, 8));
        better(flat_took, measure(detector, flat, 8));
        better(twenty_took, measure(detector, twenty, 100));
    }
    const double dark_e = d.detector.dark_current_e_per_s * 0.066;
    const Took standard_dark = standard(d, dark_e), standard_flat = standard(d, 20'000);
    const std::int64_t targets = hwy::SupportedAndGeneratedTargets().front();
    fmt::print(
        "{{\"sensor\": \"{}\", \"width\": {}, \"height\": {}, \"threads\": 1, \"instruction_set\": \"{}\",\n"
        " \"dark_sky_ms\": {:.3f}, \"flat_20ke_ms\": {:.3f}, \"windows_20x20x20_ms\": {:.4f},\n"
        " \"dark_sky_cpu_ms\": {:.3f}, \"flat_20ke_cpu_ms\": {:.3f}, \"windows_20x20x20_cpu_ms\": {:.4f},\n"
        " \"std_dark_sky_ms\": {:.1f}, \"std_flat_20ke_ms\": {:.1f},\n"
        " \"ratio_dark_sky\": {:.1f}, \"ratio_flat_20ke\": {:.1f}}}\n",
        d.name, w, h, hwy::TargetName(targets), dark_took.wall_ms, flat_took.wall_ms, twenty_took.wall_ms,
        dark_took.cpu_ms, flat_took.cpu_ms, twenty_took.cpu_ms, standard_dark.wall_ms, standard_flat.wall_ms,
        standard_dark.cpu_ms / dark_took.cpu_ms, standard_flat.cpu_ms / flat_took.cpu_ms);
    return 0;
}
