// SPDX-License-Identifier: Apache-2.0
// Verb `obscura texture mount`: the levels of a giant texture as files of a read-only file system in user
// space, for programs that cannot read .obt. Without libfuse3 at build time it says so.
#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "core/text/printable.hpp"
#include "terrain/obt/obt_file.hpp"
#include "tools/verbs/texture.hpp"

#include <fmt/format.h>

#if OBSCURA_HAS_FUSE
#define FUSE_USE_VERSION 314
#include <fuse.h>
#endif

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::tools {
namespace {

using namespace terrain;

#if OBSCURA_HAS_FUSE

constexpr double whole_degrees = 180 / std::numbers::pi;

std::string system_of(const Projection& p) {
    if (p.kind == ProjectionKind::planar) return {};
    const std::string spheroid =
        p.latitudes == Latitudes::planetographic
            ? fmt::format("+a={:.17g} +b={:.17g}", p.equatorial_radius_m, p.polar_radius_m)
            : fmt::format("+R={:.17g}", p.equatorial_radius_m);
    const double longitude = p.centre_longitude_rad * whole_degrees,
                 scale = p.true_scale_latitude_rad * whole_degrees;
    if (p.kind == ProjectionKind::simple_cylindrical)
        return fmt::format("  <SRS>+proj=eqc +lat_ts={:.17g} +lon_0={:.17g} {} +units=m</SRS>\n", scale,
                           longitude, spheroid);
    return fmt::format("  <SRS>+proj=stere +lat_0={} +lat_ts={:.17g} +lon_0={:.17g} {} +units=m</SRS>\n",
                       p.kind == ProjectionKind::north_polar_stereographic ? 90 : -90, scale, longitude,
                       spheroid);
}

/// A level as two files: f32 values of all planes, row by row, plane after plane, and GDAL's description of
/// them. Thread-safe.
class MountedTexture {
public:
    explicit MountedTexture(const std::filesystem::path& file) : texture_(file) {
        for (int level = 0; level < texture_.levels(); ++level)
            descriptions_.push_back(description(level));
    }

    struct Name {
        int level = 0;
        bool samples = false; ///< else the description
    };
    /// Of "/level3.f32" or "/level3.vrt".
    [[nodiscard]] std::optional<Name> find(std::string_view path) const {
        for (int level = 0; level < texture_.levels(); ++level) {
            if (path == fmt::format("/level{}.f32", level)) return Name{level, true};
            if (path == fmt::format("/level{}.vrt", level)) return Name{level, false};
        }
        return std::nullopt;
    }
    [[nodiscard]] int levels() const { return texture_.levels(); }
    [[nodiscard]] std::uint64_t size(const Name& name) const {
        return name.samples ? sizeof(float) * count(name.level) * texture_.metadata().planes
                            : descriptions_[static_cast<std::size_t>(name.level)].size();
    }
    /// Bytes that were read. Throws InputError.
    std::size_t read(const Name& name, std::uint64_t at, std::size_t bytes, char* out) const {
        const std::uint64_t all = size(name);
        if (at >= all) return 0;
        bytes = static_cast<std::size_t>(std::min<std::uint64_t>(bytes, all - at));
        if (!name.samples) {
            std::memcpy(out, descriptions_[static_cast<std::size_t>(name.level)].data() + at, bytes);
            return bytes;
        }
        const std::uint64_t first = at / sizeof(float), last = (at + bytes - 1) / sizeof(float);
        std::vector<float> values(static_cast<std::size_t>(last - first + 1));
        for (std::uint64_t k = first; k <= last;)
            k += read_rows(name.level, k, last - k + 1, values.data() + (k - first));
        std::memcpy(out, reinterpret_cast<const char*>(values.data()) + at % sizeof(float), bytes);
        return bytes;
    }

private:
    [[nodiscard]] std::uint64_t count(int level) const {
        return static_cast<std::uint64_t>(texture_.width(level)) *
               static_cast<std::uint64_t>(texture_.height(level));
    }
    /// Values from number `first` on, to the end of the row or whole rows of one plane; how many.
    std::uint64_t read_rows(int level, std::uint64_t first, std::uint64_t wanted, float* out) const {
        const auto width = static_cast<std::uint64_t>(texture_.width(level)), plane = count(level);
        const std::uint64_t y = first % plane / width, x = first % width;
        const std::uint64_t rows = x == 0 ? std::min(wanted / width, plane / width - y) : 0;
        const std::uint64_t columns = rows > 0 ? width : std::min(wanted, width - x);
        const std::uint64_t read = columns * std::max<std::uint64_t>(rows, 1);
        texture_.read(static_cast<std::uint32_t>(first / plane), level, static_cast<std::int64_t>(x),
                      static_cast<std::int64_t>(y), static_cast<int>(columns),
                      static_cast<int>(std::max<std::uint64_t>(rows, 1)),
                      {out, static_cast<std::size_t>(read)});
        return read;
    }
    [[nodiscard]] std::string description(int level) const {
        const ObtMetadata& m = texture_.metadata();
        const double step = std::ldexp(1.0, level);
        // GDAL counts from the outer corner of the first pixel; nodes of a level are at each 2^level-th one.
        const double corner = m.registration == Registration::node ? -0.5 * step : 0;
        const PixelTransform& t = m.transform;
        std::string text = fmt::format(
            "<VRTDataset rasterXSize=\"{}\" rasterYSize=\"{}\">\n"
            "{}  <GeoTransform>{:.17g}, {:.17g}, {:.17g}, {:.17g}, {:.17g}, {:.17g}</GeoTransform>\n",
            texture_.width(level), texture_.height(level), system_of(m.projection),
            t[0] + corner * (t[1] + t[2]), step * t[1], step * t[2], t[3] + corner * (t[4] + t[5]),
            step * t[4], step * t[5]);
        for (std::uint32_t plane = 0; plane < m.planes; ++plane)
            text += fmt::format(
                "  <VRTRasterBand dataType=\"Float32\" band=\"{}\" subClass=\"VRTRawRasterBand\">\n"
                "    <NoDataValue>nan</NoDataValue>\n"
                "    <SourceFilename relativeToVRT=\"1\">level{}.f32</SourceFilename>\n"
                "    <ImageOffset>{}</ImageOffset><PixelOffset>4</PixelOffset><LineOffset>{}</LineOffset><ByteOrder>LSB</ByteOrder>\n"
                "  </VRTRasterBand>\n",
                plane + 1, level, 4 * count(level) * plane, 4 * texture_.width(level));
        return text + "</VRTDataset>\n";
    }

    ObtFile texture_;
    std::vector<std::string> descriptions_;
};

const MountedTexture& mounted() {
    return *static_cast<const MountedTexture*>(fuse_get_context()->private_data);
}

int get_attributes(const char* path, struct stat* about, fuse_file_info* /*file*/) {
    *about = {};
    if (std::string_view(path) == "/") {
        about->st_mode = S_IFDIR | 0555;
        about->st_nlink = 2;
        return 0;
    }
    const auto name = mounted().find(path);
    if (!name) return -ENOENT;
    about->st_mode = S_IFREG | 0444;
    about->st_nlink = 1;
    about->st_size = static_cast<off_t>(mounted().size(*name));
    return 0;
}

int list_folder(const char* path, void* buffer, fuse_fill_dir_t fill, off_t /*offset*/,
                fuse_file_info* /*file*/, fuse_readdir_flags /*flags*/) {
    if (std::string_view(path) != "/") return -ENOENT;
    for (const char* name : {".", ".."})
        fill(buffer, name, nullptr, 0, fuse_fill_dir_flags{});
    for (int level = 0; level < mounted().levels(); ++level)
        for (const char* ending : {"f32", "vrt"})
            fill(buffer, fmt::format("level{}.{}", level, ending).c_str(), nullptr, 0, fuse_fill_dir_flags{});
    return 0;
}

int open_file(const char* path, fuse_file_info* file) {
    if (!mounted().find(path)) return -ENOENT;
    if ((file->flags & O_ACCMODE) != O_RDONLY) return -EROFS;
    file->keep_cache = 1; // the texture does not change
    return 0;
}

int read_file(const char* path, char* out, std::size_t bytes, off_t at, fuse_file_info* /*file*/) {
    const auto name = mounted().find(path);
    if (!name || at < 0) return -ENOENT;
    try {
        return static_cast<int>(mounted().read(*name, static_cast<std::uint64_t>(at), bytes, out));
    } catch (const std::exception& error) { // a damaged tile, no memory
        print_message(fmt::format("obscura texture mount: {}", error.what()));
        return -EIO;
    }
}

/// Serves until it is unmounted or a signal comes.
void serve(MountedTexture& texture, const std::string& folder) {
    fuse_operations operations{};
    operations.getattr = get_attributes;
    operations.readdir = list_folder;
    operations.open = open_file;
    operations.read = read_file;
    std::string program = "obscura", option = "-o", options = "ro,fsname=obscura,subtype=obt";
    char* words[] = {program.data(), option.data(), options.data()};
    fuse_args arguments = FUSE_ARGS_INIT(3, words);
    fuse* const system = fuse_new(&arguments, &operations, sizeof operations, &texture);
    fuse_opt_free_args(&arguments);
    if (system == nullptr) throw HardwareError("obscura texture mount: libfuse3 refuses to start");
    const std::unique_ptr<fuse, void (*)(fuse*)> owner(system, fuse_destroy);
    if (fuse_mount(system, folder.c_str()) != 0)
        throw HardwareError(fmt::format(
            "{}: cannot be mounted: needs /dev/fuse, the right to mount or the package fuse3 (fusermount3), and an empty folder of one's own",
            folder));
    fuse_session* const session = fuse_get_session(system);
    // libfuse leaves handlers alone that are there already.
    std::signal(SIGINT, SIG_DFL);
    std::signal(SIGTERM, SIG_DFL);
    fuse_set_signal_handlers(session);
    fmt::print("{}: mounted; ends with Ctrl-C or `umount`\n", folder);
    std::fflush(stdout);
    fuse_loop(system);
    fuse_remove_signal_handlers(session);
    fuse_unmount(system);
}

#endif

class TextureMount final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "shows the levels of a giant texture as files for other programs";
        line.description =
            "Mounts a giant texture (.obt) as a read-only folder: for each level levelN.f32, its values as 32-bit reals, little endian, row by row and plane after plane (missing samples are NaN), and levelN.vrt, which GDAL, QGIS and programs on them open as a map with its projection. "
            "Nothing is written to disk; tiles are read as they are asked for. "
            "Runs until the folder is unmounted or Ctrl-C. Slower than reading the texture itself; "
            "`obscura texture export` writes a level as GeoTIFF.";
        line.positional("FILE", &file_, "Giant texture");
        line.positional("FOLDER", &folder_, "Empty folder");
        line.examples = {"obscura texture mount moon.obt /mnt/moon"};
    }

    [[nodiscard]] bool runs_until_told() const override { return true; }

    int run() override {
#if OBSCURA_HAS_FUSE
        MountedTexture texture(file_);
        if (!is_folder_at(folder_)) throw InputError(fmt::format("{}: is no folder", folder_));
        serve(texture, absolute_path(folder_).string());
        return exit_ok;
#else
        throw HardwareError("obscura texture mount: this program was built without libfuse3 (libfuse3-dev)");
#endif
    }

private:
    std::string file_, folder_;
};

} // namespace

std::unique_ptr<Verb> make_texture_mount() {
    return std::make_unique<TextureMount>();
}

} // namespace obscura::tools
