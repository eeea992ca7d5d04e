// SPDX-License-Identifier: Apache-2.0
// Prints what a giant texture says of itself and writes its finest samples as f32, for tests in Python.
// Usage: obt_dump TEXTURE SAMPLES
#include "terrain/obt/obt_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <fstream>
#include <numbers>
#include <vector>

using namespace obscura;

int main(int argc, char* argv[]) {
    if (argc != 3) return 64;
    try {
        const terrain::ObtFile file{std::filesystem::path(argv[1])};
        const terrain::ObtMetadata& m = file.metadata();
        std::ofstream out(argv[2], std::ios::binary | std::ios::trunc);
        std::vector<float> rows;
        for (std::uint32_t plane = 0; plane < m.planes; ++plane)
            for (std::int64_t y = 0; y < m.height; y += 64) {
                const int count = static_cast<int>(std::min<std::int64_t>(64, m.height - y));
                rows.resize(static_cast<std::size_t>(m.width * count));
                file.read(plane, 0, 0, y, static_cast<int>(m.width), count, rows);
                out.write(reinterpret_cast<const char*>(rows.data()),
                          static_cast<std::streamsize>(rows.size() * sizeof(float)));
            }
        if (!out.flush()) return 74;
        const terrain::MapFrame frame = m.frame();
        const auto corner = [&](double x, double y) {
            const Vec3 p = frame.position({x, y});
            constexpr double degrees = 180 / std::numbers::pi;
            return fmt::format("[{}, {}]", m.projection.longitude_rad(p) * degrees,
                               m.projection.latitude_rad(p) * degrees);
        };
        fmt::print("{{\"width\": {}, \"height\": {}, \"planes\": {}, \"kind\": \"{}\", \"type\": \"{}\", "
                   "\"scale\": {}, \"offset\": {}, "
                   "\"projection\": \"{}\", \"registration\": \"{}\", \"meaning\": \"{}\", \"semi_axes_m\": "
                   "[{}, {}, {}], "
                   "\"transform\": [{}], \"corners\": {{\"first\": {}, \"last\": {}}}}}\n",
                   m.width, m.height, m.planes, name_of(m.kind), name_of(m.type), m.scale, m.offset,
                   name_of(m.projection.kind), name_of(m.registration), name_of(m.height_meaning),
                   m.semi_axes_m.x, m.semi_axes_m.y, m.semi_axes_m.z, fmt::join(m.transform, ", "),
                   corner(0, 0), corner(static_cast<double>(m.width - 1), static_cast<double>(m.height - 1)));
    } catch (const std::exception& error) {
        fmt::print(stderr, "{}\n", error.what());
        return 1;
    }
    return 0;
}
