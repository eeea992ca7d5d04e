// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: a trajectory or attitude message from anywhere. Whatever it holds, it is read or refused
// in one line; what was read gives finite positions and unit quaternions at any time.
#include "core/error.hpp"
#include "ephemeris/trajectories/aem.hpp"
#include "ephemeris/trajectories/oem.hpp"
#include "ephemeris/trajectories/sampled_path.hpp"
#include "tests/fuzz/scratch_folder.hpp"

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

using namespace obscura;
using namespace obscura::ephemeris;
using test::require;

namespace {

template<typename Read>
std::optional<PathFile> try_to(Read read) {
    try {
        return read();
    } catch (const Error& error) {
        const std::string_view what = error.what();
        require(!what.empty());
        for (const char c : what)
            require(static_cast<unsigned char>(c) >= 0x20 && c != 0x7F);
    }
    return {};
}

/// Calls `look` with the path and times within its segments, at their ends and far from them.
template<typename Look>
void look_at(const PathFile& file, Look look) {
    const SampledPath path(file, file.segments.front().start, 1);
    for (const double time_s : path.times_s()) {
        look(path, time_s);
        look(path, time_s + 0.3);
    }
    for (const double time_s : {-1e300, -5.0, 1e5, 1e300})
        look(path, time_s);
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const LeapSeconds leap_seconds = erfa_leap_seconds();
    const std::string text(reinterpret_cast<const char*>(data), size);
    if (const auto read = try_to([&] { return parse_oem(text, "input", leap_seconds); }))
        look_at(*read, [](const SampledPath& path, double time_s) {
            require(is_finite(path.position_m(time_s)));
            require(path.age_s(time_s) >= 0);
        });
    if (const auto read = try_to([&] { return parse_aem(text, "input", leap_seconds); }))
        look_at(*read, [](const SampledPath& path, double time_s) {
            require(std::abs(norm(path.orientation(time_s)) - 1) < 1e-9);
        });
    return 0;
}
