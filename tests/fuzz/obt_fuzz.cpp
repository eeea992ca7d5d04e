// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: edits of giant textures whose checksums are put right again, opened, read and checked.
// The first byte selects the texture, the second the checksums, then follow 3 bytes of place and one of value
// each.
#include "core/error.hpp"
#include "terrain/obt/obt_file.hpp"
#include "terrain/obt/obt_writer.hpp"
#include "tests/fuzz/memory_file.hpp"
#include "tests/fuzz/scratch_folder.hpp"
#include "tests/support/obt_patch.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>

using namespace obscura;
using namespace obscura::terrain;
using namespace obscura::test;

namespace {

class Waves final : public ObtSource {
public:
    explicit Waves(bool holes) : holes_(holes) {}
    void read(std::uint32_t plane, std::int64_t x, std::int64_t y, int columns, int rows,
              std::span<float> out) override {
        for (int j = 0; j < rows; ++j)
            for (int i = 0; i < columns; ++i) {
                const auto v = static_cast<float>((x + i) * 3 % 50 + (y + j) % 31 + plane);
                out[static_cast<std::size_t>(j) * static_cast<std::size_t>(columns) +
                    static_cast<std::size_t>(i)] =
                    holes_ && v < 4 ? std::numeric_limits<float>::quiet_NaN() : v;
            }
    }

private:
    bool holes_;
};

std::string texture(SampleType type, bool lattice) {
    const ScratchFolder folder;
    ObtMetadata m;
    m.kind = ObtKind::parameter;
    m.type = type;
    m.lattice = lattice;
    m.planes = lattice ? 1 : 2;
    m.width = 300;
    m.height = 70;
    m.projection = Projection::of_sphere(ProjectionKind::north_polar_stereographic, 1737400);
    m.transform = {-1000, 10, 0, 500, 0, -10};
    Waves source(lattice || type == SampleType::f32);
    (void)write_obt(folder.path() / "a.obt", m, source);
    std::ifstream in(folder.path() / "a.obt", std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const std::array textures{texture(SampleType::u8, false), texture(SampleType::u16, true),
                                     texture(SampleType::f32, false)};
    if (size < 2 || size > 4096) return 0;
    std::string bytes = textures[data[0] % textures.size()];
    for (std::size_t k = 2; k + 4 <= size; k += 4) {
        const std::size_t place = data[k] | data[k + 1] << 8U | data[k + 2] << 16U;
        if (place < bytes.size())
            bytes[place] = static_cast<char>(data[k + 3]);
        else if ((data[1] & 8U) != 0)
            bytes.resize(place % bytes.size() + 1);
    }
    fix_checksums(bytes, {(data[1] & 1U) == 0, (data[1] & 2U) == 0, (data[1] & 4U) == 0});
    const MemoryFile file(bytes.data(), bytes.size());
    try {
        const ObtFile read(file.path(), std::size_t{1} << 20);
        std::array<float, 64> out{};
        for (int level = 0; level < read.levels(); ++level)
            for (std::uint32_t plane = 0; plane < read.metadata().planes; ++plane)
                try {
                    const auto w = static_cast<int>(std::min<std::int64_t>(8, read.width(level)));
                    const auto h = static_cast<int>(std::min<std::int64_t>(8, read.height(level)));
                    read.read(plane, level, read.width(level) - w, read.height(level) - h, w, h, out);
                    for (const float v : out)
                        require(std::isnan(v) || std::isfinite(v) || std::abs(read.metadata().scale) > 1);
                    (void)read.range(plane, 3, 3, 200, 50);
                } catch (const InputError& e) {
                    require(std::string(e.what()).find('\n') == std::string::npos);
                }
        (void)read.check();
    } catch (const InputError& e) {
        require(std::string(e.what()).find('\n') == std::string::npos);
    }
    return 0;
}
