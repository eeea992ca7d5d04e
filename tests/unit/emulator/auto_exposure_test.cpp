// SPDX-License-Identifier: Apache-2.0
#include "emulator/camera/auto_exposure.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace auto_exposure_test {

using namespace obscura::emulator;

namespace {

ExposureReading reading(double signal_dn, std::int64_t exposure_ns) {
    ExposureReading r;
    r.signal_dn = signal_dn;
    r.black_dn = 95;
    r.requested_ns = r.obtained_ns = exposure_ns;
    r.min_ns = 1000;
    r.max_ns = 1'000'000'000;
    return r;
}

} // namespace

TEST_CASE("percentiles of the histogram are those of the sorted numbers") {
    DnHistogram histogram(12);
    CHECK(histogram.percentile(50) == 0);
    std::vector<std::uint16_t> numbers;
    for (std::uint32_t i = 0; i < 997; ++i)
        numbers.push_back(static_cast<std::uint16_t>(i * i * 31 % 5000)); // some beyond 12 bits
    histogram.add(std::span(numbers).first(400));
    histogram.add(std::span(numbers).subspan(400));
    CHECK(histogram.pixels() == 997);
    std::sort(numbers.begin(), numbers.end());
    for (const double percent : {1.0, 10.0, 50.0, 99.0, 99.9, 100.0}) {
        CAPTURE(percent);
        const auto rank = static_cast<std::size_t>(std::ceil(percent / 100 * 997)) - 1;
        CHECK(histogram.percentile(percent) == std::min<std::uint32_t>(numbers[rank], 4095));
    }
    histogram.clear();
    CHECK(histogram.pixels() == 0);
    CHECK(histogram.percentile(100) == 0);
}

TEST_CASE("one step leads to the goal where the signal says how far it is") {
    // Black 95, white 4095: the goal of 50 % is at 2095, and 1095 is half of the way to it.
    const ExposureStep half = next_exposure(reading(1095, 10'000'000));
    CHECK(half.exposure_ns == 20'000'000);
    CHECK_FALSE(half.settled);
    const ExposureStep above = next_exposure(reading(3095, 10'000'000));
    CHECK(above.exposure_ns == 6'666'667);
    const ExposureStep there = next_exposure(reading(2125, 10'000'000));
    CHECK(there.exposure_ns == 10'000'000);
    CHECK(there.settled);
}

TEST_CASE("where it does not, a factor of four is the longest step") {
    CHECK(next_exposure(reading(4095, 10'000'000)).exposure_ns == 2'500'000); // full scale
    CHECK(next_exposure(reading(100, 10'000'000)).exposure_ns == 40'000'000); // within the noise of black
    CHECK(next_exposure(reading(0, 10'000'000)).exposure_ns == 40'000'000);   // below black
    CHECK(next_exposure(reading(150, 10'000'000)).exposure_ns == 40'000'000); // goal 36 times as far
}

TEST_CASE("limits end the search, those of the chip as well") {
    const ExposureStep longest = next_exposure(reading(95, 900'000'000));
    CHECK(longest.exposure_ns == 1'000'000'000);
    CHECK_FALSE(longest.settled);
    CHECK(next_exposure(reading(95, 1'000'000'000)).settled);
    CHECK(next_exposure(reading(4095, 1000)).settled);
    ExposureReading chip = reading(95, 40'000'000);
    chip.obtained_ns = 10'000'000; // it does no more
    const ExposureStep stuck = next_exposure(chip);
    CHECK(stuck.exposure_ns == 40'000'000);
    CHECK(stuck.settled);
}

TEST_CASE("from anywhere to the goal of a steady scene in a few frames") {
    for (const double dn_per_ms : {2.0, 50.0, 900.0})
        for (const std::int64_t begin_ns : {std::int64_t{1000}, std::int64_t{1'000'000'000}}) {
            CAPTURE(dn_per_ms, begin_ns);
            const auto signal = [&](std::int64_t exposure_ns) {
                return std::floor(std::min(4095.0, 95 + dn_per_ms * static_cast<double>(exposure_ns) / 1e6));
            };
            std::int64_t exposure_ns = begin_ns;
            int frames = 0;
            for (bool settled = false; !settled; ++frames) {
                const ExposureStep step = next_exposure(reading(signal(exposure_ns), exposure_ns));
                exposure_ns = step.exposure_ns;
                settled = step.settled;
            }
            CHECK(frames <= 13); // a factor of a million is ten steps of four
            CHECK(std::abs(signal(exposure_ns) - 2095) < 0.03 * 2000);
        }
}

} // namespace auto_exposure_test
