// SPDX-License-Identifier: Apache-2.0
// Main program of obscura-gdal: reads maps through GDAL for `obscura import map`, by protocol.hpp on standard
// input and output. Ends when its input ends.
#include "tools/gdal/protocol.hpp"

#include <cpl_conv.h>
#include <cpl_error.h>
#include <cpl_string.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <gdal.h>
#include <ogr_srs_api.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <string>
#include <vector>

namespace {

using namespace obscura::tools;

/// A refusal, which is sent to the other process as one line of text.
class Refusal : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

std::vector<std::string> warnings;

void collect(CPLErr kind, CPLErrorNum /*number*/, const char* text) {
    if (kind == CE_Warning && warnings.size() < 16) warnings.push_back(one_line(text));
}

[[noreturn]] void refuse_last(const char* otherwise) {
    const std::string last = one_line(CPLGetLastErrorMsg());
    throw Refusal(last.empty() ? otherwise : last);
}

struct CloseDataset {
    void operator()(void* dataset) const { GDALClose(dataset); }
};
using Dataset = std::unique_ptr<void, CloseDataset>;
struct DestroySystem {
    void operator()(void* system) const { OSRDestroySpatialReference(system); }
};
using System = std::unique_ptr<void, DestroySystem>;

// Only what is documented: fewer parsers stand open to damaged files.
constexpr const char* drivers[] = {"PDS", "PDS4", "ISIS3", "ISIS2", "VICAR", "GTiff", "JP2OpenJPEG",
                                   "PNG", "JPEG", "FITS",  "ENVI",  "VRT",   nullptr};
constexpr std::size_t open_limit = 24;

/// Files by number; the ones used last are open.
class Files {
public:
    std::uint32_t add(std::string name) {
        entries_.push_back({std::move(name), nullptr, 0});
        try {
            (void)dataset(static_cast<std::uint32_t>(entries_.size() - 1));
        } catch (...) {
            entries_.pop_back();
            throw;
        }
        return static_cast<std::uint32_t>(entries_.size() - 1);
    }
    GDALDatasetH dataset(std::uint32_t id) {
        if (id >= entries_.size()) throw Refusal("no such file is open");
        Entry& entry = entries_[id];
        entry.used = ++clock_;
        if (entry.dataset) return entry.dataset.get();
        close_oldest();
        CPLErrorReset();
        entry.dataset.reset(GDALOpenEx(entry.name.c_str(),
                                       GDAL_OF_RASTER | GDAL_OF_READONLY | GDAL_OF_VERBOSE_ERROR, drivers,
                                       nullptr, nullptr));
        if (!entry.dataset) refuse_last("no driver of GDAL takes it");
        return entry.dataset.get();
    }

private:
    struct Entry {
        std::string name;
        Dataset dataset;
        std::uint64_t used;
    };
    void close_oldest() {
        std::size_t open = 0;
        Entry* oldest = nullptr;
        for (Entry& entry : entries_)
            if (entry.dataset) {
                ++open;
                if (oldest == nullptr || entry.used < oldest->used) oldest = &entry;
            }
        if (open >= open_limit) oldest->dataset.reset();
    }
    std::vector<Entry> entries_;
    std::uint64_t clock_ = 0;
};

GdalType type_of(GDALRasterBandH band, bool& complex) {
    complex = false;
    switch (GDALGetRasterDataType(band)) {
    case GDT_Byte: {
        const char* signedness = GDALGetMetadataItem(band, "PIXELTYPE", "IMAGE_STRUCTURE");
        return signedness != nullptr && EQUAL(signedness, "SIGNEDBYTE") ? GdalType::i8 : GdalType::u8;
    }
#if GDAL_VERSION_NUM >= GDAL_COMPUTE_VERSION(3, 7, 0)
    case GDT_Int8:
        return GdalType::i8;
#endif
    case GDT_UInt16:
        return GdalType::u16;
    case GDT_Int16:
        return GdalType::i16;
    case GDT_UInt32:
        return GdalType::u32;
    case GDT_Int32:
        return GdalType::i32;
    case GDT_Float32:
        return GdalType::f32;
    case GDT_Float64:
        return GdalType::f64;
    default:
        complex = true;
        return GdalType::f64;
    }
}

GDALDataType gdal_type(GdalType type) {
    switch (type) {
    case GdalType::u8:
        return GDT_Byte;
#if GDAL_VERSION_NUM >= GDAL_COMPUTE_VERSION(3, 7, 0)
    case GdalType::i8:
        return GDT_Int8;
#else
    case GdalType::i8:
        return GDT_Byte; // the bits are the same
#endif
    case GdalType::u16:
        return GDT_UInt16;
    case GdalType::i16:
        return GDT_Int16;
    case GdalType::u32:
        return GDT_UInt32;
    case GdalType::i32:
        return GDT_Int32;
    case GdalType::f32:
        return GDT_Float32;
    case GdalType::f64:
        return GDT_Float64;
    }
    return GDT_Unknown;
}

std::string text_or(const char* text, const char* otherwise) {
    return text != nullptr ? text : otherwise;
}

void describe_system(GDALDatasetH dataset, GdalMap& map) {
    OGRSpatialReferenceH system = GDALGetSpatialRef(dataset);
    if (system == nullptr) return;
    OGRErr error = OGRERR_NONE;
    if (const double major = OSRGetSemiMajor(system, &error); error == OGRERR_NONE) map.semi_major_m = major;
    if (const double minor = OSRGetSemiMinor(system, &error); error == OGRERR_NONE) map.semi_minor_m = minor;
    map.prime_meridian_deg = OSRGetPrimeMeridian(system, nullptr) * OSRGetAngularUnits(system, nullptr) *
                             (180 / 3.14159265358979323846);
    if (OSRIsGeographic(system) != 0) {
        map.system = GdalSystem::geographic;
        map.degrees_per_unit = OSRGetAngularUnits(system, nullptr) * (180 / 3.14159265358979323846);
    } else if (OSRIsProjected(system) != 0) {
        map.system = GdalSystem::projected;
        map.metres_per_unit = OSRGetLinearUnits(system, nullptr);
        map.method = text_or(OSRGetAttrValue(system, "PROJECTION", 0), "");
        for (const char* name :
             {SRS_PP_CENTRAL_MERIDIAN, SRS_PP_LATITUDE_OF_ORIGIN, SRS_PP_STANDARD_PARALLEL_1,
              SRS_PP_STANDARD_PARALLEL_2, SRS_PP_SCALE_FACTOR, SRS_PP_FALSE_EASTING, SRS_PP_FALSE_NORTHING,
              SRS_PP_LONGITUDE_OF_CENTER, SRS_PP_LATITUDE_OF_CENTER}) {
            const double value = OSRGetNormProjParm(system, name, 0, &error);
            if (error == OGRERR_NONE) map.parameters.emplace_back(name, value);
        }
    } else {
        map.system = GdalSystem::local;
        map.metres_per_unit = OSRGetLinearUnits(system, nullptr);
    }
}

void add_text(GdalMap& map, const char* key, const char* value) {
    constexpr std::size_t longest = std::size_t{4} << 20;
    if (value != nullptr && std::strlen(value) < longest) map.texts.emplace_back(key, value);
}

GdalMap described(GDALDatasetH dataset, std::uint32_t id) {
    GdalMap map;
    map.id = id;
    map.driver = text_or(GDALGetDriverShortName(GDALGetDatasetDriver(dataset)), "?");
    map.width = GDALGetRasterXSize(dataset);
    map.height = GDALGetRasterYSize(dataset);
    map.band_count = static_cast<std::uint32_t>(GDALGetRasterCount(dataset));
    if (map.band_count == 0) throw Refusal("there is no raster in it");
    for (std::uint32_t i = 1; i <= std::min(map.band_count, gdal_band_limit); ++i) {
        GDALRasterBandH band = GDALGetRasterBand(dataset, static_cast<int>(i));
        if (band == nullptr) refuse_last("a band cannot be opened");
        GdalBand b;
        bool complex = false;
        b.type = type_of(band, complex);
        if (complex)
            throw Refusal(fmt::format(
                "band {} has samples of type {}: integers of 8, 16 or 32 bits or real numbers are wanted", i,
                text_or(GDALGetDataTypeName(GDALGetRasterDataType(band)), "?")));
        int across = 0, down = 0;
        GDALGetBlockSize(band, &across, &down);
        b.block_width = static_cast<std::uint32_t>(std::max(across, 0));
        b.block_height = static_cast<std::uint32_t>(std::max(down, 0));
        b.palette = GDALGetRasterColorTable(band) != nullptr;
        const int mask = GDALGetMaskFlags(band);
        b.masked = (mask & (GMF_ALL_VALID | GMF_NODATA)) == 0;
        int present = 0;
        if (const double v = GDALGetRasterNoDataValue(band, &present); present != 0) b.nodata = v;
        if (const double v = GDALGetRasterScale(band, &present); present != 0) b.scale = v;
        if (const double v = GDALGetRasterOffset(band, &present); present != 0) b.offset = v;
        b.unit = text_or(GDALGetRasterUnitType(band), "");
        map.bands.push_back(b);
    }
    std::array<double, 6> transform{};
    if (GDALGetGeoTransform(dataset, transform.data()) == CE_None) map.transform = transform;
    describe_system(dataset, map);
    for (CSLConstList item = GDALGetMetadata(dataset, nullptr); item != nullptr && *item != nullptr; ++item) {
        char* key = nullptr;
        const char* value = CPLParseNameValue(*item, &key);
        if (key != nullptr && map.texts.size() < 1000) add_text(map, key, value);
        CPLFree(key);
    }
    for (const auto& [domain, key] : {std::pair{"json:ISIS3", "label:ISIS3"}, {"xml:PDS4", "label:PDS4"}})
        if (CSLConstList label = GDALGetMetadata(dataset, domain); label != nullptr)
            add_text(map, key, *label);
    map.warnings = warnings;
    return map;
}

std::string read_block(Files& files, const GdalBlock& block) {
    GDALDatasetH dataset = files.dataset(block.id);
    GDALRasterBandH band = GDALGetRasterBand(dataset, static_cast<int>(block.band));
    if (band == nullptr) throw Refusal("no such band");
    if (block.x + block.columns > GDALGetRasterXSize(dataset) ||
        block.y + block.rows > GDALGetRasterYSize(dataset))
        throw Refusal("the block is not in the raster");
    bool complex = false;
    const GdalType type = block.mask ? GdalType::u8 : type_of(band, complex);
    const std::uint64_t bytes = std::uint64_t{block.columns} * block.rows * bytes_of(type);
    if (bytes > gdal_message_limit) throw Refusal("the block is too large");
    std::string out(bytes, '\0');
    CPLErrorReset();
    GDALRasterBandH source = block.mask ? GDALGetMaskBand(band) : band;
    const int columns = static_cast<int>(block.columns), rows = static_cast<int>(block.rows);
    if (GDALRasterIO(source, GF_Read, static_cast<int>(block.x), static_cast<int>(block.y), columns, rows,
                     out.data(), columns, rows, gdal_type(type), 0, 0) != CE_None)
        refuse_last("samples cannot be read");
    return out;
}

std::string transformed(Files& files, GdalTransform request) {
    OGRSpatialReferenceH system = GDALGetSpatialRef(files.dataset(request.id));
    if (system == nullptr) throw Refusal("it has no coordinate system");
    // From the file's own geographic system: another would bring in the Earth or another body.
    const System geographic(OSRCloneGeogCS(system));
    const System map(OSRClone(system));
    if (!geographic || !map) refuse_last("its coordinate system is not usable");
    OSRSetAxisMappingStrategy(geographic.get(), OAMS_TRADITIONAL_GIS_ORDER);
    OSRSetAxisMappingStrategy(map.get(), OAMS_TRADITIONAL_GIS_ORDER);
    CPLErrorReset();
    const std::unique_ptr<void, void (*)(void*)> transform(
        request.inverse ? OCTNewCoordinateTransformation(map.get(), geographic.get())
                        : OCTNewCoordinateTransformation(geographic.get(), map.get()),
        [](void* t) { OCTDestroyCoordinateTransformation(static_cast<OGRCoordinateTransformationH>(t)); });
    if (!transform) refuse_last("its projection is not usable");
    std::vector<double> x, y;
    for (const auto& [longitude, latitude] : request.points) {
        x.push_back(longitude);
        y.push_back(latitude);
    }
    std::vector<int> good(x.size(), 0);
    OCTTransformEx(static_cast<OGRCoordinateTransformationH>(transform.get()), static_cast<int>(x.size()),
                   x.data(), y.data(), nullptr, good.data());
    std::string out(x.size() * 16, '\0');
    for (std::size_t i = 0; i < x.size(); ++i) {
        constexpr double none = std::numeric_limits<double>::quiet_NaN();
        const bool valid = good[i] != 0 && std::isfinite(x[i]) && std::isfinite(y[i]);
        const double xy[2] = {valid ? x[i] : none, valid ? y[i] : none};
        std::memcpy(out.data() + i * 16, xy, 16);
    }
    return out;
}

/// False at the end of the input; throws at its end within a message.
bool receive(void* to, std::size_t bytes) {
    char* at = static_cast<char*>(to);
    while (bytes > 0) {
        const ssize_t done = read(STDIN_FILENO, at, bytes);
        if (done < 0 && errno == EINTR) continue;
        if (done <= 0) return false;
        at += done;
        bytes -= static_cast<std::size_t>(done);
    }
    return true;
}

bool send(int out, GdalMessage kind, std::string_view body) {
    const GdalHeader header{kind, 0, body.size()};
    for (std::string_view part :
         {std::string_view(reinterpret_cast<const char*>(&header), sizeof header), body})
        while (!part.empty()) {
            const ssize_t done = write(out, part.data(), part.size());
            if (done < 0 && errno == EINTR) continue;
            if (done <= 0) return false;
            part.remove_prefix(static_cast<std::size_t>(done));
        }
    return true;
}

bool answer(int out, Files& files, GdalMessage kind, std::span<const std::byte> body) {
    warnings.clear();
    const auto opened = [&](std::string name) {
        const std::uint32_t id = files.add(std::move(name));
        return send(out, GdalMessage::opened, encoded(described(files.dataset(id), id)));
    };
    switch (kind) {
    case GdalMessage::open:
        return opened(std::string(reinterpret_cast<const char*>(body.data()), body.size()));
    case GdalMessage::read:
        return send(out, GdalMessage::samples, read_block(files, decoded_block(body)));
    case GdalMessage::transform:
        return send(out, GdalMessage::points, transformed(files, decoded_transform(body)));
    default:
        throw Refusal("an unknown request");
    }
}

int serve() {
    // What libraries print would be taken for answers.
    const int out = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 3);
    const int null = open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (out < 0 || null < 0 || dup2(null, STDOUT_FILENO) < 0) return 70;
    CPLSetErrorHandler(collect);
    for (const auto& [key, value] : {std::pair{"GDAL_CACHEMAX", "64"},
                                     {"CPL_VSIL_CURL_ALLOWED_EXTENSIONS", "{none}"},
                                     {"GDAL_VRT_ENABLE_PYTHON", "NO"},
                                     {"OSR_DEFAULT_AXIS_MAPPING_STRATEGY", "TRADITIONAL_GIS_ORDER"},
                                     {"GTIFF_POINT_GEO_IGNORE", "NO"}})
        CPLSetConfigOption(key, value);
    GDALAllRegister();
    Files files;
    GdalHeader header;
    std::vector<std::byte> body;
    while (receive(&header, sizeof header)) {
        if (header.bytes > gdal_message_limit) return 70;
        std::string why;
        try {
            body.resize(header.bytes);
            if (!receive(body.data(), body.size())) return 70;
            if (!answer(out, files, header.kind, body)) return 74;
            continue;
        } catch (const std::bad_alloc&) {
            why = "not enough memory";
        } catch (const std::exception& error) {
            why = error.what();
        }
        if (!send(out, GdalMessage::refused, one_line(why))) return 74;
    }
    return 0;
}

} // namespace

int main(int argc, char* /*argv*/[]) {
    if (argc > 1 || isatty(STDIN_FILENO) != 0) {
        std::fputs(
            "obscura-gdal: reads maps for `obscura import map`, which starts it; it takes no arguments\n",
            stderr);
        return 64;
    }
    return serve();
}
