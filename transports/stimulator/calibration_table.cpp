// SPDX-License-Identifier: Apache-2.0
#include "transports/stimulator/calibration_table.hpp"

#include "core/error.hpp"
#include "core/io/input_file.hpp"
#include "images/writers/pending_file.hpp"

#include <fitsio.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

namespace obscura::transports {
namespace {

constexpr int max_nodes_a_side = 4096;
constexpr int max_side = 16384;

struct FitsCloser {
    void operator()(fitsfile* file) const {
        int status = 0;
        fits_close_file(file, &status);
    }
};
using Fits = std::unique_ptr<fitsfile, FitsCloser>;

std::string fits_text(int status) {
    std::array<char, FLEN_STATUS> text{};
    fits_get_errstatus(status, text.data());
    fits_clear_errmsg();
    return text.data();
}

// --- writing

class TableWriter {
public:
    explicit TableWriter(const std::filesystem::path& file) : name_(file.string()) {
        fitsfile* raw = nullptr;
        // fits_create_file() would interpret brackets in the name.
        fits_create_diskfile(&raw, name_.c_str(), &status_);
        check();
        file_.reset(raw);
        fits_create_img(raw, BYTE_IMG, 0, nullptr, &status_);
        check();
    }
    void key(const char* keyword, double value, const char* comment) {
        fits_update_key(file_.get(), TDOUBLE, keyword, &value, comment, &status_);
        check();
    }
    void image(const char* extension, std::vector<long> size, const std::vector<double>& values) {
        fits_create_img(file_.get(), DOUBLE_IMG, static_cast<int>(size.size()), size.data(), &status_);
        fits_update_key(file_.get(), TSTRING, "EXTNAME", const_cast<char*>(extension), nullptr, &status_);
        fits_write_img(file_.get(), TDOUBLE, 1, static_cast<LONGLONG>(values.size()),
                       const_cast<double*>(values.data()), &status_);
        check();
    }
    void close() {
        fits_close_file(file_.release(), &status_);
        check();
    }

private:
    void check() const {
        if (status_ != 0) throw OutputError(fmt::format("{}: {}", name_, fits_text(status_)));
    }
    std::string name_;
    Fits file_;
    int status_ = 0;
};

// --- reading

struct TableImage {
    std::vector<long> size;
    std::vector<double> values;
};

class TableReader {
public:
    explicit TableReader(const std::filesystem::path& file) : name_(file.string()) {
        if (!is_plain_fits(file)) fail(fits_text(FILE_NOT_OPENED));
        fitsfile* raw = nullptr;
        int status = 0;
        fits_open_diskfile(&raw, name_.c_str(), READONLY, &status);
        if (status != 0) fail(fits_text(status));
        file_.reset(raw);
    }
    [[noreturn]] void fail(const std::string& why) const {
        throw InputError(fmt::format("{}: {}", name_, why));
    }
    /// Number key of the extension read last (initially the primary).
    double key(const char* keyword, double low, double high) {
        double value = 0;
        int status = 0;
        fits_read_key(file_.get(), TDOUBLE, keyword, &value, nullptr, &status);
        if (status != 0) fail(fmt::format("key {} is missing or no number", keyword));
        if (!(value >= low && value <= high))
            fail(fmt::format("key {} is {}, allowed: {}..{}", keyword, value, low, high));
        return value;
    }
    int whole(const char* keyword, int low, int high) {
        const double value = key(keyword, low, high);
        if (value != std::floor(value))
            fail(fmt::format("key {} is {}, allowed: whole numbers", keyword, value));
        return static_cast<int>(value);
    }
    /// Reads an extension of at most `most` numbers, all finite. Returns false if it is missing.
    bool image(const char* extension, std::size_t dimensions, std::size_t most, TableImage& image) {
        int status = 0;
        fits_movnam_hdu(file_.get(), IMAGE_HDU, const_cast<char*>(extension), 0, &status);
        if (status != 0) {
            fits_clear_errmsg();
            return false;
        }
        int naxis = 0, type = 0;
        std::array<long, 3> axes{};
        fits_get_img_param(file_.get(), 3, &type, &naxis, axes.data(), &status);
        if (status != 0) fail(fmt::format("{}: {}", extension, fits_text(status)));
        if (naxis != static_cast<int>(dimensions))
            fail(fmt::format("{} has {} dimensions instead of {}", extension, naxis, dimensions));
        std::size_t count = 1;
        for (std::size_t i = 0; i < dimensions; ++i) {
            if (axes[i] < 1 || static_cast<std::size_t>(axes[i]) > most / count)
                fail(fmt::format("{} is too large or empty, allowed: 1..{} numbers", extension, most));
            count *= static_cast<std::size_t>(axes[i]);
        }
        image.size.assign(axes.begin(), axes.begin() + static_cast<std::ptrdiff_t>(dimensions));
        image.values.resize(count);
        int any_null = 0;
        fits_read_img(file_.get(), TDOUBLE, 1, static_cast<LONGLONG>(count), nullptr, image.values.data(),
                      &any_null, &status);
        if (status != 0) fail(fmt::format("{}: {}", extension, fits_text(status)));
        for (const double v : image.values)
            if (!std::isfinite(v)) fail(fmt::format("{} holds a number that is not finite", extension));
        return true;
    }

private:
    std::string name_;
    Fits file_;
};

void check_grid(const TableReader& in, const char* name, int columns, int rows, double step) {
    if (columns < 2 || rows < 2 || columns > max_nodes_a_side || rows > max_nodes_a_side || !(step > 0))
        in.fail(
            fmt::format("{} has {}x{} nodes, allowed: 2..{} a side", name, columns, rows, max_nodes_a_side));
}

} // namespace

double UniformityGrid::operator()(PixelPoint p) const {
    if (columns == 0) return 1;
    const double gx = std::clamp((p.x - x0) / step, 0.0, static_cast<double>(columns - 1));
    const double gy = std::clamp((p.y - y0) / step, 0.0, static_cast<double>(rows - 1));
    const int ix = std::min(static_cast<int>(gx), std::max(0, columns - 2));
    const int iy = std::min(static_cast<int>(gy), std::max(0, rows - 2));
    const auto at = [&](int c, int r) {
        return static_cast<double>(
            values[static_cast<std::size_t>(std::min(r, rows - 1)) * static_cast<std::size_t>(columns) +
                   static_cast<std::size_t>(std::min(c, columns - 1))]);
    };
    const double fx = gx - ix, fy = gy - iy;
    return (1 - fy) * ((1 - fx) * at(ix, iy) + fx * at(ix + 1, iy)) +
           fy * ((1 - fx) * at(ix, iy + 1) + fx * at(ix + 1, iy + 1));
}

void write_calibration(const std::filesystem::path& file, const CalibrationTable& t) {
    images::PendingFile pending(file);
    std::error_code ignored;
    std::filesystem::remove(pending.path(), ignored); // cfitsio must create the file itself
    TableWriter out(pending.path());
    out.key("SCREENW", t.screen_width, "[pixel] width of the screen");
    out.key("SCREENH", t.screen_height, "[pixel] height of the screen");
    out.key("CAMERAW", t.camera_width, "[pixel] width of the camera image");
    out.key("CAMERAH", t.camera_height, "[pixel] height of the camera image");
    out.key("LEVELS", t.levels, "drive levels of the screen");
    out.key("RESIDUAL", t.residual_px, "[pixel] RMS of the dots about the map, camera");
    out.image("HOMOGRAPHY", {3, 3}, {t.map.homography.h.begin(), t.map.homography.h.end()});
    if (const DistortionGrid& g = t.map.distortion; !g.empty()) {
        std::vector<double> values(g.du.begin(), g.du.end());
        values.insert(values.end(), g.dv.begin(), g.dv.end());
        out.image("DISTORTION", {g.columns, g.rows, 2}, values);
        out.key("GRIDX0", g.x0, "[pixel] screen x of the first node");
        out.key("GRIDY0", g.y0, "[pixel] screen y of the first node");
        out.key("GRIDSTEP", g.step, "[pixel] distance of the nodes");
    }
    if (!t.curve.empty()) {
        std::vector<double> values;
        for (const CurvePoint& p : t.curve) {
            values.push_back(p.level);
            values.push_back(p.luminance);
        }
        out.image("CURVE", {2, static_cast<long>(t.curve.size())}, values);
    }
    if (const UniformityGrid& g = t.uniformity; g.columns > 0) {
        out.image("UNIFORMITY", {g.columns, g.rows}, {g.values.begin(), g.values.end()});
        out.key("GRIDX0", g.x0, "[pixel] screen x of the first node");
        out.key("GRIDY0", g.y0, "[pixel] screen y of the first node");
        out.key("GRIDSTEP", g.step, "[pixel] distance of the nodes");
    }
    if (!t.dead.empty()) {
        std::vector<double> values;
        for (const ScreenPixel& p : t.dead) {
            values.push_back(p.x);
            values.push_back(p.y);
        }
        out.image("DEAD", {2, static_cast<long>(t.dead.size())}, values);
    }
    out.close();
    pending.commit();
}

CalibrationTable read_calibration(const std::filesystem::path& file) {
    TableReader in(file);
    CalibrationTable t;
    t.screen_width = in.whole("SCREENW", 1, max_side);
    t.screen_height = in.whole("SCREENH", 1, max_side);
    t.camera_width = in.whole("CAMERAW", 1, max_side);
    t.camera_height = in.whole("CAMERAH", 1, max_side);
    t.levels = in.whole("LEVELS", 2, 65536);
    t.residual_px = in.key("RESIDUAL", 0, 1e6);
    TableImage image;
    if (!in.image("HOMOGRAPHY", 2, 9, image) || image.values.size() != 9)
        in.fail("HOMOGRAPHY is missing or not 3x3");
    std::copy(image.values.begin(), image.values.end(), t.map.homography.h.begin());
    // The map must not fold over anywhere on the screen.
    for (const double x : {0.0, t.screen_width - 1.0})
        for (const double y : {0.0, t.screen_height - 1.0})
            if (!(t.map.homography.h[6] * x + t.map.homography.h[7] * y + t.map.homography.h[8] > 0))
                in.fail("HOMOGRAPHY sends a corner of the screen through infinity");

    constexpr std::size_t most = 2u * max_nodes_a_side * max_nodes_a_side;
    if (in.image("DISTORTION", 3, most, image)) {
        DistortionGrid& g = t.map.distortion;
        g.columns = static_cast<int>(image.size[0]);
        g.rows = static_cast<int>(image.size[1]);
        g.x0 = in.key("GRIDX0", -max_side, max_side);
        g.y0 = in.key("GRIDY0", -max_side, max_side);
        g.step = in.key("GRIDSTEP", 0.5, max_side);
        check_grid(in, "DISTORTION", g.columns, g.rows, g.step);
        if (image.size[2] != 2) in.fail("DISTORTION has not two planes");
        const auto half = image.values.begin() + static_cast<std::ptrdiff_t>(image.values.size() / 2);
        for (const double v : image.values)
            if (std::abs(v) > max_side) in.fail(fmt::format("DISTORTION of {} pixels", v));
        g.du.assign(image.values.begin(), half);
        g.dv.assign(half, image.values.end());
    }
    if (in.image("CURVE", 2, 2u * 65536, image)) {
        if (image.size[0] != 2) in.fail("CURVE has not two columns");
        for (std::size_t i = 0; i + 1 < image.values.size(); i += 2)
            t.curve.push_back({image.values[i], image.values[i + 1]});
        try {
            RadiometricCurve(t.levels, t.curve);
        } catch (const ConfigError& error) {
            in.fail(error.what());
        }
    }
    if (in.image("UNIFORMITY", 2, most, image)) {
        UniformityGrid& g = t.uniformity;
        g.columns = static_cast<int>(image.size[0]);
        g.rows = static_cast<int>(image.size[1]);
        g.x0 = in.key("GRIDX0", -max_side, max_side);
        g.y0 = in.key("GRIDY0", -max_side, max_side);
        g.step = in.key("GRIDSTEP", 0.5, max_side);
        check_grid(in, "UNIFORMITY", g.columns, g.rows, g.step);
        for (const double v : image.values)
            if (v < 0 || v > 100) in.fail(fmt::format("UNIFORMITY of {}, allowed: 0..100", v));
        g.values.assign(image.values.begin(), image.values.end());
    }
    if (in.image("DEAD", 2, 2u << 20, image)) {
        if (image.size[0] != 2) in.fail("DEAD has not two columns");
        for (std::size_t i = 0; i + 1 < image.values.size(); i += 2) {
            const double x = image.values[i], y = image.values[i + 1];
            if (!(x >= 0 && x < t.screen_width && y >= 0 && y < t.screen_height) || x != std::floor(x) ||
                y != std::floor(y))
                in.fail(fmt::format("DEAD names pixel {},{}, which is not on the {}x{} screen", x, y,
                                    t.screen_width, t.screen_height));
            t.dead.push_back({static_cast<std::int32_t>(x), static_cast<std::int32_t>(y)});
        }
    }
    return t;
}

} // namespace obscura::transports
