// SPDX-License-Identifier: Apache-2.0
#include "tools/import/near_msi.hpp"

#include "core/error.hpp"
#include "core/geometry.hpp"
#include "core/io/input_file.hpp"
#include "core/io/path_state.hpp"
#include "core/units.hpp"
#include "images/readers/pds_label.hpp"
#include "tools/import/utc.hpp"

#include <fitsio.h>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace obscura::tools {
namespace {

// Camera (Hawkins et al. 1997, Space Sci. Rev. 82, 31; NEAR instrument kernel msi15): the boresight in
// spacecraft axes, the focal length, and the pixels of the CCD, 16 um wide and 27 um high. Processing on the
// ground may resample its 244 lines to 412, of square pixels.
constexpr Vec3 boresight_spacecraft{0.9999988429, -0.0004838414, 0.0014422523};
constexpr double focal_length_m = 0.16685, pixel_pitch_m = 16e-6, line_pitch_m = 27e-6;
constexpr double samples_per_line = 537, raw_lines = 244, resampled_lines = 412;
// Filters by wheel position (NEAR-009): typical values, not checked against a published table. They and the
// aperture below only scale the image's brightness.
struct Filter {
    double centre_nm, width_nm;
};
constexpr Filter filters[] = {{700, 200}, {550, 29}, {450, 44},  {760, 20},
                              {950, 43},  {900, 34}, {1000, 66}, {1050, 78}};

// Rotation of 433 Eros (IAU WGCCRE 2009, Archinal et al. 2011): pole and prime meridian.
constexpr double pole_ra_deg = 11.35, pole_dec_deg = 17.22, meridian_deg = 326.07,
                 rate_deg_per_day = 1639.38864745;

class Header {
public:
    explicit Header(const std::filesystem::path& file) : file_(file) {
        int status = is_plain_fits(file) ? 0 : FILE_NOT_OPENED;
        fits_open_diskfile(&fits_, file.c_str(), READONLY, &status);
        if (status != 0) {
            fits_clear_errmsg();
            throw InputError(fmt::format("{}: not readable as FITS", file.string()));
        }
    }
    ~Header() {
        int ignored = 0;
        fits_close_file(fits_, &ignored);
        fits_clear_errmsg();
    }
    Header(const Header&) = delete;
    Header& operator=(const Header&) = delete;

    [[nodiscard]] std::string text(const char* key) const {
        char value[FLEN_VALUE] = {};
        int status = 0;
        fits_read_key(fits_, TSTRING, key, value, nullptr, &status);
        if (status != 0) {
            fits_clear_errmsg();
            throw InputError(
                fmt::format("{}: no {} in the header: not a NEAR MSI frame", file_.string(), key));
        }
        std::string out = value;
        out.erase(out.find_last_not_of(' ') + 1);
        return out;
    }
    [[nodiscard]] double number(const char* key) const {
        const std::string digits = text(key);
        double value = 0;
        const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
        if (error != std::errc{} || end != digits.data() + digits.size() || !std::isfinite(value))
            throw InputError(
                fmt::format("{}: {} is \"{}\", a number is wanted", file_.string(), key, digits));
        return value;
    }
    [[nodiscard]] Vec3 kilometres(const char* x, const char* y, const char* z) const {
        return Vec3{number(x), number(y), number(z)} * 1000.0;
    }
    [[nodiscard]] const std::filesystem::path& file() const { return file_; }

private:
    const std::filesystem::path& file_;
    fitsfile* fits_ = nullptr;
};

/// `given` (--utc, mid-exposure) if not empty, else the START_TIME of the label beside the frame.
std::string utc_of(const Header& header, const std::string& given) {
    if (!given.empty()) return given;
    for (const char* extension : {".lbl", ".LBL"}) {
        std::filesystem::path label = header.file();
        label.replace_extension(extension);
        if (!path_exists(label)) continue;
        return images::PdsLabel(label).text("START_TIME", "");
    }
    throw InputError(
        fmt::format("{}: no PDS3 label ({}.lbl) in the same folder to read the time from: give --utc",
                    header.file().string(), header.file().stem().string()));
}

/// Body-fixed to J2000 axes (Archinal et al. 2011, figure 1).
Quat eros_orientation(double tdb_days) {
    const double w = std::remainder(meridian_deg + rate_deg_per_day * tdb_days, 360.0) * degree;
    return axis_angle({0, 0, 1}, (90 + pole_ra_deg) * degree) *
           axis_angle({1, 0, 0}, (90 - pole_dec_deg) * degree) * axis_angle({0, 0, 1}, w);
}

std::string list(Vec3 v) {
    return fmt::format("[{:.10g}, {:.10g}, {:.10g}]", v.x, v.y, v.z);
}
std::string list(Quat q) {
    return fmt::format("[{:.12f}, {:.12f}, {:.12f}, {:.12f}]", q.w, q.x, q.y, q.z);
}

} // namespace

std::string near_msi_scene(const std::filesystem::path& frame, const NearMsiOptions& options) {
    const Header header(frame);
    if (const std::string target = header.text("NEAR-047"); target != "EROS")
        throw InputError(fmt::format("{}: the target is {}, allowed EROS", frame.string(), target));
    const double width = header.number("NAXIS1"), height = header.number("NAXIS2");
    if (width != samples_per_line || (height != raw_lines && height != resampled_lines))
        throw InputError(fmt::format(
            "{}: {} x {} pixels, allowed {} x {} (raw) and {} x {} (resampled to square pixels)",
            frame.string(), width, height, samples_per_line, raw_lines, samples_per_line, resampled_lines));
    const std::string utc = utc_of(header, options.utc);
    const std::optional<double> start_days = tdb_days_from_j2000(utc);
    if (!start_days)
        throw InputError(
            fmt::format("{}: \"{}\" is no time like 2001-02-08T17:24:42.25 after 1972", frame.string(), utc));
    // The label gives the start of the exposure, --utc its middle.
    const double exposure_s = header.number("NEAR-010") * 1e-3;
    const double days = *start_days + (options.utc.empty() ? exposure_s / 2 / 86400 : 0);

    const Vec3 target_m = header.kilometres("NEAR-027", "NEAR-028", "NEAR-029");
    const Vec3 camera_m = header.kilometres("NEAR-023", "NEAR-024", "NEAR-025") - target_m;
    const Vec3 sun_m = header.kilometres("NEAR-031", "NEAR-032", "NEAR-033") - target_m;
    const Quat q{header.number("NEAR-019"), header.number("NEAR-020"), header.number("NEAR-021"),
                 header.number("NEAR-022")};
    if (!(std::abs(norm(q) - 1) < 1e-3))
        throw InputError(fmt::format("{}: NEAR-019..022 is no unit quaternion", frame.string()));
    // The header's quaternion takes J2000 vectors to spacecraft axes (checked below against the right
    // ascension and declination that the header gives for the boresight).
    const Quat spacecraft = conjugate(normalized(q));
    const Vec3 x = boresight_spacecraft;
    const Vec3 y = normalized(Vec3{0, 1, 0} - x * dot(Vec3{0, 1, 0}, x));
    // Samples grow along x cross y, lines against y.
    const Vec3 right = cross(x, y), down = -y;
    Mat3 axes;
    axes.m[0][0] = right.x, axes.m[0][1] = down.x, axes.m[0][2] = x.x;
    axes.m[1][0] = right.y, axes.m[1][1] = down.y, axes.m[1][2] = x.y;
    axes.m[2][0] = right.z, axes.m[2][1] = down.z, axes.m[2][2] = x.z;
    const Quat camera = spacecraft * from_matrix(axes);
    const Vec3 ahead = rotate(camera, {0, 0, 1});
    const double ra_deg = std::atan2(ahead.y, ahead.x) / degree, dec_deg = std::asin(ahead.z) / degree;
    const double wrong_deg =
        std::hypot(std::remainder(ra_deg - header.number("NEAR-084"), 360.0) * std::cos(dec_deg * degree),
                   dec_deg - header.number("NEAR-085"));
    if (wrong_deg > 0.5)
        throw InputError(
            fmt::format("{}: the quaternion's boresight is {:.2f} degrees away from NEAR-084 and NEAR-085",
                        frame.string(), wrong_deg));
    const auto position = static_cast<std::size_t>(std::clamp(header.number("NEAR-009"), 0.0, 7.0));
    const Filter filter = filters[position];

    std::string out;
    out += fmt::format("# {} of {}, {} UTC, from its header. J2000 axes, origin at the asteroid's centre.\n",
                       header.text("NEAR-047"), frame.filename().string(), utc);
    out += fmt::format("\nname = \"near-msi-eros\"\n\n[sun]\nposition_m = {}\n", list(sun_m));
    out += fmt::format("\n"
                       "[camera]\n"
                       "width = {}\n"
                       "height = {}\n"
                       "pixel_pitch_um = {}\n"
                       "{}focal_length_mm = {}\n"
                       "aperture_mm = 49.5\n"
                       "psf_sigma_px = 0.6\n"
                       "position_m = {}\n"
                       "orientation = {}\n",
                       width, height, pixel_pitch_m * 1e6,
                       height == raw_lines ? fmt::format("pixel_pitch_y_um = {}\n", line_pitch_m * 1e6) : "",
                       focal_length_m * 1e3, list(camera_m), list(camera));
    out += fmt::format("\n[[body]]\nname = \"Eros\"\nshape = \"mesh\"\nfile = \"{}\"\nmetres_per_unit = {}\n",
                       options.mesh, options.metres_per_unit);
    out += "material = \"eros\"\n";
    out += fmt::format("orientation = {}\nspin_axis = [0, 0, 1]\nspin_rate_deg_per_s = {:.10g}\n",
                       list(eros_orientation(days)), rate_deg_per_day / 86400);
    out += fmt::format("\n[[band]] # filter {}\nfrom_nm = {}\nto_nm = {}\n", position,
                       filter.centre_nm - filter.width_nm / 2, filter.centre_nm + filter.width_nm / 2);
    return out;
}

} // namespace obscura::tools
