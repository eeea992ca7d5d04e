// SPDX-License-Identifier: Apache-2.0
// Writes giant textures of every sample type into a folder, for texture_test.py, which knows their numbers.
#include "terrain/obt/obt_writer.hpp"
#include "tests/unit/terrain/obt_support.hpp"

#include <cstdio>
#include <filesystem>

using namespace obscura::terrain;
using obscura::test::FunctionSource;

int main(int argc, char* argv[]) {
    if (argc != 2) return 64;
    const std::filesystem::path folder = argv[1];
    // Whole eighths: exact in every type but u8, which has the whole numbers of it.
    const auto number = [](std::uint32_t plane, std::int64_t x, std::int64_t y) {
        return (x * 31 + y * 17 + std::int64_t{plane} * 5) % 2003;
    };
    ObtMetadata m;
    m.width = 1000;
    m.height = 600;
    m.licence = "CC0";
    m.title = "Numbers of a test";
    m.projection = Projection::of_sphere(ProjectionKind::south_polar_stereographic, 1737400);
    m.transform = {-50000, 100, 0, 30000, 0, -100};
    m.semi_axes_m = {1737400, 1737400, 1737400};
    for (const SampleType type :
         {SampleType::u8, SampleType::i16, SampleType::u16, SampleType::f16, SampleType::f32}) {
        ObtMetadata of_type = m;
        of_type.kind = ObtKind::parameter;
        of_type.unit = "1";
        of_type.type = type;
        of_type.planes = 2;
        const bool eighths = type == SampleType::f16 || type == SampleType::f32;
        if (type == SampleType::i16) of_type.nodata = -32768;
        FunctionSource source([&](std::uint32_t plane, std::int64_t x, std::int64_t y) {
            const std::int64_t n = number(plane, x, y);
            if (type == SampleType::i16 && x < 20 && y < 30) return std::numeric_limits<float>::quiet_NaN();
            if (type == SampleType::u8) return static_cast<float>(n % 256);
            if (type == SampleType::i16) return static_cast<float>(n - 1000);
            return static_cast<float>(n) * (eighths ? 0.125F : 1);
        });
        (void)write_obt(folder / (std::string(obscura::name_of(type)) + ".obt"), of_type, source);
    }
    // A whole body, as heights in steps by tile.
    m.type = SampleType::u16;
    m.lattice = true;
    m.width = 720;
    m.height = 360;
    m.projection = Projection::of_sphere(ProjectionKind::simple_cylindrical, 1737400, 3.141592653589793);
    const double step = 3.141592653589793 * 1737400 / 360;
    m.transform = {-360 * step, step, 0, 180 * step, 0, -step};
    FunctionSource heights([&](std::uint32_t plane, std::int64_t x, std::int64_t y) {
        return static_cast<float>(number(plane, x, y)) / 8 +
               (x > 400 ? 6000.F * static_cast<float>(y % 2) : 0);
    });
    ObtWriteOptions options;
    options.shard_bytes = 1 << 20;
    const ObtWriteReport report = write_obt(folder / "moon.obt", m, heights, options);
    return report.finished ? 0 : 1;
}
