// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: SPICE kernels: SPK, CK and binary PCK of either byte order, transfer files, text kernels.
// Whatever a file holds, it is read or refused in one line, and what is read can be evaluated at any time.
//
// Input: the file.
#include "core/error.hpp"
#include "ephemeris/kernels/apparent_place.hpp"
#include "ephemeris/kernels/ephemeris.hpp"
#include "tests/fuzz/memory_file.hpp"
#include "tests/fuzz/scratch_folder.hpp"

#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

using namespace obscura;
using namespace obscura::ephemeris;
using test::require;

namespace {

/// Clock and frames that the kernels of the corpus refer to.
constexpr std::string_view support = R"(KPL/FK
\begindata
SCLK_DATA_TYPE_77       = ( 1 )
SCLK01_MODULI_77        = ( 1000000 100 )
SCLK01_COEFFICIENTS_77  = ( 0 0. 1.D0  100000 1000. 0.99 )
FRAME_CRAFT             = -77001
FRAME_-77001_NAME       = 'CRAFT'
FRAME_-77001_CLASS      = 3
FRAME_-77001_CLASS_ID   = -77001
CK_-77001_SCLK          = -77
\begintext
)";

void orientations(const Ephemeris& kernels, const std::string& frame, const std::vector<double>& times) {
    const auto model = kernels.frame(frame);
    for (const double t : times) {
        Quat q;
        if (model->orientation(TdbTime{} + t, q) == Evaluation::ok) require(std::abs(norm(q) - 1) < 1e-3);
    }
}

void use(const Ephemeris& kernels) {
    std::vector<double> times{0, -1e9, 1e9, 12345.678};
    for (const int id : kernels.bodies()) {
        for (const Interval& i : kernels.coverage(id))
            times.insert(times.end(), {i.begin_s, (i.begin_s + i.end_s) / 2, i.end_s});
        require(!coverage_text(kernels.coverage(id)).empty());
    }
    constexpr std::size_t max_times = 64;
    if (times.size() > max_times) times.resize(max_times);
    for (const int id : kernels.bodies())
        for (const double t : times) {
            State s;
            if (kernels.state(id, 0, TdbTime{} + t, s) == Evaluation::ok)
                require(is_finite(s.position_m) && is_finite(s.velocity_m_s));
        }
    for (const Ephemeris::FrameCoverage& f : kernels.frame_coverage())
        if (!f.name.empty()) orientations(kernels, f.name, times);
    for (const int id : kernels.modelled_bodies())
        orientations(kernels, kernels.body_frame_name(id), times);
    for (const int id : kernels.bodies_with_radii())
        (void)kernels.radii_m(id);
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size > 65536) return 0;
    // Would read files of this machine.
    if (std::string_view(reinterpret_cast<const char*>(data), size).find("KERNELS_TO_LOAD") !=
        std::string_view::npos)
        return 0;
    static const test::MemoryFile fixed(support.data(), support.size());
    const test::MemoryFile file(data, size);
    try {
        use(Ephemeris({fixed.path(), file.path()}));
    } catch (const Error& error) {
        require(std::string(error.what()).find('\n') == std::string::npos);
    }
    return 0;
}
