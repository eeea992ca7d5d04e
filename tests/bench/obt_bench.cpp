// SPDX-License-Identifier: Apache-2.0
// Rate at which giant textures are written and checked, and the memory that it takes.
//   obt_bench FOLDER [MEGASAMPLES] [u16|f32|lattice]
#include "terrain/obt/obt_file.hpp"
#include "terrain/obt/obt_writer.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

using namespace obscura::terrain;

namespace {

double seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
double processor_seconds() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const auto of = [](const timeval& t) {
        return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    return of(usage.ru_utime) + of(usage.ru_stime);
}

/// Rows out of a table: the cost of the source is small.
class Table final : public ObtSource {
public:
    Table() : values_(65536 + 8192) {
        for (std::size_t k = 0; k < values_.size(); ++k)
            values_[k] = static_cast<float>(std::floor(2000 + 1500 * std::sin(static_cast<double>(k) / 300) +
                                                       static_cast<double>(k * 2654435761U % 64)));
    }
    void read(std::uint32_t /*plane*/, std::int64_t x, std::int64_t y, int columns, int rows,
              std::span<float> out) override {
        for (int j = 0; j < rows; ++j) {
            const auto first = static_cast<std::size_t>((x + (y + j) * 7) % 65536);
            for (std::size_t i = 0, w = static_cast<std::size_t>(columns); i < w; i += 8192)
                std::copy_n(values_.begin() + static_cast<std::ptrdiff_t>((first + i) % 65536),
                            std::min<std::size_t>(8192, w - i),
                            out.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(j) * w + i));
        }
    }

private:
    std::vector<float> values_;
};

} // namespace

int main(int argc, char* argv[]) {
    if (argc < 2) return 64;
    const std::filesystem::path file = std::filesystem::path(argv[1]) / "obt_bench.obt";
    const std::string type = argc > 3 ? argv[3] : "u16";
    ObtMetadata m;
    m.type = type == "f32" ? SampleType::f32 : SampleType::u16;
    m.lattice = type == "lattice";
    m.projection.kind = ProjectionKind::planar;
    m.height = static_cast<std::int64_t>(1000 * std::sqrt((argc > 2 ? std::atof(argv[2]) : 800) / 2));
    m.width = 2 * m.height;
    Table source;
    ObtWriteOptions options;
    options.resume = false;
    double wall = seconds(), processor = processor_seconds();
    const ObtWriteReport report = write_obt(file, m, source, options);
    wall = seconds() - wall;
    processor = processor_seconds() - processor;
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const double mb = static_cast<double>(report.bytes) / 1e6, write_s = wall, write_cpu_s = processor;
    const double memory_mb = static_cast<double>(usage.ru_maxrss) / 1024;
    wall = seconds();
    processor = processor_seconds();
    const ObtCheck check = ObtFile(file, 0).check();
    fmt::print("{{\"width\": {}, \"height\": {}, \"type\": \"{}\", \"mb\": {:.0f}, \"write_s\": {:.2f}, "
               "\"write_cpu_s\": {:.2f}, \"write_mb_s\": {:.0f}, \"memory_mb\": {:.0f}, \"check_s\": {:.2f}, "
               "\"check_cpu_s\": {:.2f}, \"damaged\": {}}}\n",
               m.width, m.height, type, mb, write_s, write_cpu_s, mb / write_s, memory_mb, seconds() - wall,
               processor_seconds() - processor, check.damaged);
    std::filesystem::remove(file);
    return check.damaged == 0 ? 0 : 1;
}
