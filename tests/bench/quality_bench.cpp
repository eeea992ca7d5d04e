// SPDX-License-Identifier: Apache-2.0
// Deadlines missed by the quality controller: a million simulated frames for each of several costs and
// stalls. Usage: quality_bench [FRAMES (1000000)]; prints a Markdown table.
#include "tests/unit/emulator/simulated_load.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <vector>

using namespace obscura;
using namespace obscura::test;

int main(int argc, char** argv) {
    const long frames = argc > 1 ? std::atol(argv[1]) : 1'000'000;
    constexpr unsigned seeds = 4;
    std::printf("| full rendering takes at most | stalls up to | frames late | share | all full | error, "
                "mean | 99 %% |\n"
                "| --- | --- | --- | --- | --- | --- | --- |\n");
    for (const double full_ms : {90.0, 125.0, 300.0})
        for (const double stall_ms : {40.0, 60.0}) {
            long late = 0, full = 0, made = 0;
            double sum = 0;
            std::vector<double> errors;
            for (unsigned seed = 1; seed <= seeds; ++seed) {
                emulator::QualityController controller;
                SimulatedSeries series(seed, full_ms * 1e6, stall_ms * 1e6);
                for (long f = 0; f < frames / seeds; ++f, ++made) {
                    const SimulatedFrame frame = series.next(controller);
                    late += frame.late > 0 ? 1 : 0;
                    full += frame.is_full() ? 1 : 0;
                    errors.push_back(frame.mean_error() / SimulatedFrame::error[0]);
                    sum += errors.back();
                }
            }
            const auto at = errors.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(made));
            std::nth_element(errors.begin(), at, errors.end());
            std::printf("| %.0f ms | %.0f ms | %ld | %.1e | %.1f %% | %.3f | %.2f |\n", full_ms, stall_ms,
                        late, static_cast<double>(late) / static_cast<double>(made),
                        100 * static_cast<double>(full) / static_cast<double>(made),
                        sum / static_cast<double>(made), *at);
            std::fflush(stdout);
        }
}
