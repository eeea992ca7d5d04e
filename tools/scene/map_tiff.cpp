// SPDX-License-Identifier: Apache-2.0
#include "tools/scene/map_tiff.hpp"

#include "core/error.hpp"
#include "images/writers/pending_file.hpp"

#include <fmt/format.h>
#include <tiffio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

namespace obscura::tools {
namespace {

using namespace terrain;

/// Tags of GeoTIFF (OGC 19-008r4) and GDAL.
enum GeoTag : std::uint32_t {
    pixel_scale = 33550,
    tie_points = 33922,
    transformation = 34264,
    key_directory = 34735,
    key_doubles = 34736,
    gdal_nodata = 42113,
};

constexpr std::int64_t max_side = (std::int64_t{1} << 31) - 1;

struct CloseTiff {
    void operator()(TIFF* tiff) const noexcept { TIFFClose(tiff); }
};

void add_geo_tags(TIFF* tiff) {
    static std::array<char, 1> name{};
    static const std::array fields{
        TIFFFieldInfo{pixel_scale, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, name.data()},
        TIFFFieldInfo{tie_points, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, name.data()},
        TIFFFieldInfo{transformation, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, name.data()},
        TIFFFieldInfo{key_directory, -1, -1, TIFF_SHORT, FIELD_CUSTOM, 1, 1, name.data()},
        TIFFFieldInfo{key_doubles, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, name.data()},
        TIFFFieldInfo{gdal_nodata, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, name.data()}};
    TIFFMergeFieldInfo(tiff, fields.data(), fields.size());
}

/// Keys of GeoTIFF: numbers, and doubles in an array of their own.
class GeoKeys {
public:
    void add(std::uint16_t key, std::uint16_t value) {
        directory_.insert(directory_.end(), {key, 0, 1, value});
        ++directory_[3];
    }
    void add_real(std::uint16_t key, double value) {
        directory_.insert(directory_.end(),
                          {key, key_doubles, 1, static_cast<std::uint16_t>(doubles_.size())});
        doubles_.push_back(value);
        ++directory_[3];
    }
    void write(TIFF* tiff) {
        TIFFSetField(tiff, key_directory, static_cast<int>(directory_.size()), directory_.data());
        if (!doubles_.empty())
            TIFFSetField(tiff, key_doubles, static_cast<int>(doubles_.size()), doubles_.data());
    }

private:
    std::vector<std::uint16_t> directory_{1, 1, 0, 0};
    std::vector<double> doubles_;
};

void write_place(TIFF* tiff, const ObtMetadata& m, int level) {
    const double factor = std::ldexp(1.0, level);
    const PixelTransform& t = m.transform;
    // The first node of each level is the first of the finest.
    if (t[2] == 0 && t[4] == 0 && t[1] > 0 && t[5] < 0) {
        const std::array<double, 3> scale{t[1] * factor, -t[5] * factor, 0};
        const std::array<double, 6> tie{0, 0, 0, t[0], t[3], 0};
        TIFFSetField(tiff, pixel_scale, 3, scale.data());
        TIFFSetField(tiff, tie_points, 6, tie.data());
    } else {
        const std::array<double, 16> matrix{t[1] * factor,
                                            t[2] * factor,
                                            0,
                                            t[0],
                                            t[4] * factor,
                                            t[5] * factor,
                                            0,
                                            t[3],
                                            0,
                                            0,
                                            0,
                                            0,
                                            0,
                                            0,
                                            0,
                                            1};
        TIFFSetField(tiff, transformation, 16, matrix.data());
    }
    constexpr std::uint16_t user_defined = 32767, metre = 9001, degree = 9102;
    const Projection& p = m.projection;
    GeoKeys keys;
    keys.add(1024, p.kind == ProjectionKind::planar ? user_defined : 1); // model: projected
    keys.add(1025, m.registration == Registration::pixel ? 1 : 2);       // raster type
    if (p.kind != ProjectionKind::planar) {
        constexpr double degrees = 180 / std::numbers::pi;
        const bool sphere = p.latitudes == Latitudes::planetocentric;
        keys.add(2048, user_defined); // geographic system, its datum, units and ellipsoid
        keys.add(2050, user_defined);
        keys.add(2052, metre);
        keys.add(2054, degree);
        keys.add(2056, user_defined);
        keys.add_real(2057, p.equatorial_radius_m);
        keys.add_real(2058, sphere ? p.equatorial_radius_m : p.polar_radius_m);
        keys.add(3072, user_defined); // projected system
        keys.add(3074, user_defined);
        const bool cylindrical = p.kind == ProjectionKind::simple_cylindrical;
        keys.add(3075, cylindrical ? 17 : 15); // equirectangular, polar stereographic
        keys.add(3076, metre);
        if (cylindrical) keys.add_real(3078, p.true_scale_latitude_rad * degrees);
        if (!cylindrical) keys.add_real(3081, p.true_scale_latitude_rad * degrees);
        keys.add_real(3082, 0); // false easting and northing
        keys.add_real(3083, 0);
        if (cylindrical) keys.add_real(3088, p.centre_longitude_rad * degrees);
        if (!cylindrical) keys.add_real(3092, 1); // scale
        if (!cylindrical) keys.add_real(3095, p.centre_longitude_rad * degrees);
    }
    keys.write(tiff);
}

template<typename Number>
void put_row(const std::vector<float>& values, float missing, std::vector<std::byte>& out) {
    out.resize(values.size() * sizeof(Number));
    for (std::size_t i = 0; i < values.size(); ++i) {
        // In the byte order of the machine, which the header of the file states.
        const auto number = static_cast<Number>(std::isnan(values[i]) ? missing : values[i]);
        std::copy_n(reinterpret_cast<const std::byte*>(&number), sizeof number,
                    out.begin() + static_cast<std::ptrdiff_t>(i * sizeof number));
    }
}

} // namespace

bool write_map_tiff(const std::filesystem::path& file, const ObtFile& texture, int level,
                    const std::function<bool(std::uint64_t rows)>& progress) {
    const ObtMetadata& m = texture.metadata();
    const std::int64_t width = texture.width(level), height = texture.height(level);
    if (width > max_side || height > max_side)
        throw InputError(fmt::format(
            "{}: level {} of {} x {} samples: a TIFF file has at most 2^31 - 1 each way, take a coarser level",
            texture.name(), level, width, height));
    const bool whole = (m.type == SampleType::u8 || m.type == SampleType::i16 || m.type == SampleType::u16) &&
                       !m.lattice && m.scale == 1 && m.offset == 0;
    const std::size_t bytes = whole ? bytes_of(m.type) : sizeof(float);
    TIFFSetErrorHandler(nullptr);
    TIFFSetWarningHandler(nullptr);
    images::PendingFile pending(file);
    const long double size = static_cast<long double>(width) * static_cast<long double>(height) *
                             static_cast<long double>(bytes * m.planes);
    const std::unique_ptr<TIFF, CloseTiff> tiff(TIFFOpen(pending.path().c_str(), size > 2e9L ? "w8" : "w"));
    if (!tiff) pending.fail("it cannot be created");
    add_geo_tags(tiff.get());
    TIFFSetField(tiff.get(), TIFFTAG_IMAGEWIDTH, static_cast<std::uint32_t>(width));
    TIFFSetField(tiff.get(), TIFFTAG_IMAGELENGTH, static_cast<std::uint32_t>(height));
    TIFFSetField(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, m.planes);
    TIFFSetField(tiff.get(), TIFFTAG_BITSPERSAMPLE, static_cast<int>(8 * bytes));
    TIFFSetField(tiff.get(), TIFFTAG_SAMPLEFORMAT,
                 !whole                      ? SAMPLEFORMAT_IEEEFP
                 : m.type == SampleType::i16 ? SAMPLEFORMAT_INT
                                             : SAMPLEFORMAT_UINT);
    TIFFSetField(tiff.get(), TIFFTAG_PLANARCONFIG,
                 m.planes > 1 ? PLANARCONFIG_SEPARATE : PLANARCONFIG_CONTIG);
    TIFFSetField(tiff.get(), TIFFTAG_PHOTOMETRIC, m.rgb ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK);
    if (m.planes > 1 && !m.rgb) {
        const std::vector<std::uint16_t> extra(m.planes - 1, EXTRASAMPLE_UNSPECIFIED);
        TIFFSetField(tiff.get(), TIFFTAG_EXTRASAMPLES, static_cast<int>(extra.size()), extra.data());
    }
    TIFFSetField(tiff.get(), TIFFTAG_ROWSPERSTRIP,
                 static_cast<std::uint32_t>(std::clamp<std::int64_t>(65536 / (width + 1), 1, 256)));
    if (!m.licence.empty()) TIFFSetField(tiff.get(), TIFFTAG_COPYRIGHT, m.licence.c_str());
    write_place(tiff.get(), m, level);
    float missing = std::numeric_limits<float>::quiet_NaN();
    if (whole && m.nodata) {
        missing = static_cast<float>(*m.nodata);
        TIFFSetField(tiff.get(), gdal_nodata, fmt::format("{}", *m.nodata).c_str());
    } else if (!whole && texture.statistics(0).holes) {
        TIFFSetField(tiff.get(), gdal_nodata, "nan");
    }
    std::vector<float> values(static_cast<std::size_t>(width));
    std::vector<std::byte> row;
    for (std::uint32_t plane = 0; plane < m.planes; ++plane)
        for (std::int64_t y = 0; y < height; ++y) {
            texture.read(plane, level, 0, y, static_cast<int>(width), 1, values);
            if (!whole)
                put_row<float>(values, missing, row);
            else if (m.type == SampleType::u8)
                put_row<std::uint8_t>(values, missing, row);
            else if (m.type == SampleType::i16)
                put_row<std::int16_t>(values, missing, row);
            else
                put_row<std::uint16_t>(values, missing, row);
            if (TIFFWriteScanline(tiff.get(), row.data(), static_cast<std::uint32_t>(y),
                                  static_cast<std::uint16_t>(plane)) != 1)
                pending.fail("writing failed");
            if (y % 64 == 0 && progress &&
                !progress(plane * static_cast<std::uint64_t>(height) + static_cast<std::uint64_t>(y)))
                return false;
        }
    if (TIFFFlush(tiff.get()) != 1) pending.fail("writing failed");
    pending.commit();
    return true;
}

} // namespace obscura::tools
