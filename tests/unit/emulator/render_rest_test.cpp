// SPDX-License-Identifier: Apache-2.0
// Rest of threads that render: how much of any second, in what pieces, and that waiting counts.
#include "emulator/render/render_rest.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <deque>

namespace render_rest_test {

using namespace obscura;
using namespace obscura::emulator;

namespace {

/// Renders rows of `row_ns` for ten seconds; between frames of `rows` rows it waits for `wait_ns`.
struct Rendering {
    std::int64_t row_ns, wait_ns = 0;
    int rows = 1024;
    std::int64_t rested_ns = 0, max_owed_ns = 0;
    std::int64_t min_rest_per_second_ns = ns_per_s; ///< of any second, waits included

    void run(double share) {
        RenderRest rest(share);
        struct Piece {
            Time at;
            std::int64_t ns;
        };
        std::deque<Piece> pieces; // of not working, in the last second
        Time now{7 * ns_per_s};
        const Time begin = now;
        const auto idle = [&](std::int64_t ns) {
            pieces.push_back({now, ns});
            now = now + ns;
        };
        for (int row = 0; now - begin < 10 * ns_per_s; ++row) {
            const bool first = row % rows == 0;
            if (first && wait_ns > 0) idle(wait_ns);
            if (const std::int64_t owed = rest.owed(now, first); owed > 0) {
                idle(owed + 50'000); // the kernel wakes it a little late
                rest.slept(now);
                rested_ns += owed;
                max_owed_ns = std::max(max_owed_ns, owed);
            }
            now = now + row_ns;
            while (!pieces.empty() && now - pieces.front().at > ns_per_s)
                pieces.pop_front();
            if (now - begin < ns_per_s) continue;
            std::int64_t sum = 0;
            for (const Piece& piece : pieces)
                sum += piece.ns;
            min_rest_per_second_ns = std::min(min_rest_per_second_ns, sum);
        }
    }
};

} // namespace

TEST_CASE("a thread that renders all the time rests for more of any second than the kernel would take") {
    const std::int64_t row_ns = GENERATE(50'000, 700'000, 5'000'000, 20'000'000);
    CAPTURE(row_ns);
    Rendering rendering{row_ns};
    rendering.run(0.93);
    CHECK(rendering.min_rest_per_second_ns > 50 * ns_per_ms);
    CHECK(rendering.max_owed_ns <= RenderRest::max_rest_ns);
    CHECK(rendering.rested_ns < ns_per_s); // a tenth of the ten seconds
}

TEST_CASE("a thread that waits for long enough between frames does not rest") {
    // Frames of 90 ms, each after 10 ms.
    Rendering rendering{90'000, 10 * ns_per_ms, 1000};
    rendering.run(0.93);
    CHECK(rendering.rested_ns < 200 * ns_per_ms);
    CHECK(rendering.min_rest_per_second_ns > 50 * ns_per_ms);
}

TEST_CASE("a thread that may work all the time never rests") {
    Rendering rendering{1'000'000};
    rendering.run(1);
    CHECK(rendering.rested_ns == 0);
}

} // namespace render_rest_test
