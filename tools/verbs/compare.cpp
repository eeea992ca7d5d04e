// SPDX-License-Identifier: Apache-2.0
// Verb `obscura compare`: sub-pixel registration, pointing fit, correlation, I/F and residual of two images;
// matched stars of two lists.
#include "core/error.hpp"
#include "core/solar_spectrum.hpp"
#include "core/units.hpp"
#include "host/irradiance_image.hpp"
#include "images/image.hpp"
#include "images/writers/fits.hpp"
#include "images/writers/raw.hpp"
#include "renderer/lights/spectrum.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "tools/check/report.hpp"
#include "tools/compare/pointing.hpp"
#include "tools/compare/registration.hpp"
#include "tools/pictures/figure.hpp"
#include "tools/pictures/preview.hpp"
#include "tools/pictures/star_lists.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace obscura::tools {
namespace {

/// Limits of --max-shift and --max-roll.
constexpr std::int32_t widest_shift_px = 1024;
constexpr double widest_roll_deg = 45;

class Compare final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "compares two images (shift, scale, correlation, residual) or two star lists";
        line.description =
            "Registers two images of the same size: finds the sub-pixel shift of the highest correlation and fits IMAGE = scale * REFERENCE + offset at that shift by least squares; "
            "prints shift, scale, offset, Pearson correlation and residual. "
            "Reads FITS, PNG, OpenEXR and PDS3 (attached label, or the detached label as the file). "
            "Pixels that are NaN in either image are left out. "
            "The standard error of the shift contains noise and what the images do not share otherwise (texture, shape, shading), estimated from the autocorrelation of the residual and from the scatter between blocks of the image: a shift of several standard errors is significant. "
            "None is given where the correlation has no maximum within --max-shift (and --max-roll), because the fit is then undetermined; which limit it ends at, and how to widen that, is said. "
            "With --scene, the scene file that IMAGE was rendered from, the report also gives the scale in I/F (pi times the radiance over the Sun's irradiance at the scene's first body), which is dimensionless where REFERENCE is in I/F; "
            "and --pointing fits three angles of the camera instead of a shift: right, down and roll. "
            "If both files are star lists, CSV tables with the columns x_px and y_px (or x and y), or ra_deg and dec_deg, and magnitudes (mag, v_mag, magnitude_v, V) or fluxes (flux, signal_e, ...): matches the stars, the nearest pairs first, and prints number, mean shift and rms distance of the pairs, and the zero point: mean and scatter of the magnitude of the star in IMAGE less that in REFERENCE.";
        line.positional("REFERENCE", &reference_, "Reference image");
        line.positional("IMAGE", &image_, "Image to compare with the reference");
        line.option(
            "--reference-plane", &reference_plane_, "N|NAME",
            "Plane number (from 0) or OpenEXR channel name to read from REFERENCE (default: the first)");
        line.option("--image-plane", &image_plane_, "N|NAME",
                    "Plane number (from 0) or OpenEXR channel name to read from IMAGE (default: the first)");
        line.option(
            "--reference-column", &reference_list_.brightness, "COLUMN",
            "Star lists: column of REFERENCE with magnitudes (its name begins with mag or ends with mag, or is V) or fluxes (default: the first that is known)");
        line.option("--image-column", &image_list_.brightness, "COLUMN", "Star lists: that column of IMAGE");
        line.option(
            "--rows", &rows_, "COLUMN=VALUE",
            "Star lists: only rows with this value, of the lists that have the column; several: all must hold");
        line.number("--match-radius", &match_radius_, "PX",
                    "Star lists: largest distance of a pair, in pixels or arc seconds", 1e-6, 1e6);
        line.number("--max-rms", &max_rms_, "PX",
                    "Star lists: exit with status 1 when the rms distance is larger (0: no limit)", 0, 1e6);
        line.number(
            "--max-mag-rms", &max_mag_rms_, "MAG",
            "Star lists: exit with status 1 when the scatter about the zero point is larger (0: no limit)", 0,
            100);
        line.number("--min-pairs", &min_pairs_, "N",
                    "Star lists: exit with status 1 when fewer stars are matched", 0, 10'000'000);
        line.option("--pairs", &pairs_, "FILE.csv", "Star lists: write the pairs and their differences");
        line.number("--max-shift", &settings_.max_shift_px, "PX",
                    "Largest shift to search for in each direction, in pixels; 0: compare unshifted", 0,
                    widest_shift_px);
        line.option(
            "--scene", &scene_file_, "SCENE",
            "Scene file (TOML) that IMAGE was rendered from, whole sensor: its camera and Sun, for I/F and --pointing");
        line.flag("--pointing", pointing_,
                  "Fit the pointing of the scene's camera, two angles and a roll; "
                  "the other figures are those of IMAGE at the fitted pointing");
        line.number("--max-roll", &max_roll_deg_, "DEG",
                    "Largest roll to search for with --pointing, in degrees; the shift has --max-shift", 0,
                    widest_roll_deg);
        line.flag("--no-offset", no_offset_, "Fit a scale without an offset: IMAGE = scale * REFERENCE");
        line.number(
            "--blocks", &block_, "PX",
            "Also compare the mean brightness of square blocks with sides of PX pixels (0: no blocks)", 0,
            4096);
        line.number("--min-correlation", &min_correlation_, "R",
                    "Exit with status 1 when the correlation is lower than this", -1, 1);
        line.number("--max-offset", &max_offset_, "PX",
                    "Exit with status 1 when the shift is longer than this many pixels (0: no limit)", 0,
                    1024);
        line.option("--residual", &residual_, "FILE.fits",
                    "Write the residual IMAGE - scale * REFERENCE - offset as FITS");
        line.option(
            "--picture", &picture_, "FILE.png",
            "Write reference (scaled to the image), image and their difference side by side as a PNG with titles, one grey scale for both and a colour bar for the difference");
        stretch_options_.declare(line, "With --picture: contrast of both images");
        line.flag("--json", json_, "Print one JSON object instead of a table");
        line.examples = {
            "obscura compare flight.fit render.fits --min-correlation 0.8",
            "obscura compare flight.fit render.fits --scene scene.toml --pointing",
            "obscura compare a.exr b.exr --reference-plane irradiance.400-900nm --picture ab.png",
            "obscura compare measured.csv truth.csv --rows kind=star --rows frame=3 --max-rms 0.3",
        };
    }

    int run() override {
        if (is_star_list(reference_) && is_star_list(image_)) return compare_lists();
        const host::Stretch stretch = stretch_options_.parsed("compare");
        const Image reference = images::read_image(reference_, reference_plane_);
        Image image = images::read_image(image_, image_plane_);
        settings_.with_offset = !no_offset_;
        if (pointing_ && scene_file_.empty())
            throw host::UsageError("obscura compare: --pointing needs --scene, for the camera");
        std::optional<RenderedScene> rendered;
        if (!scene_file_.empty()) rendered.emplace(scene_of(image));
        searched_px_ = settings_.max_shift_px;
        std::optional<PointingFit> fit;
        if (pointing_) {
            fit = fit_pointing(reference, image, *rendered->lens,
                               {settings_.max_shift_px, max_roll_deg_ * degree});
            image = turned(image, *rendered->lens, fit->pointing);
            settings_.max_shift_px = 0;
        }
        const Agreement a = compare_images(reference, image, settings_);
        Report report;
        report.add("width", "width", static_cast<std::int64_t>(reference.width));
        report.add("height", "height", static_cast<std::int64_t>(reference.height));
        report.add("pixels", "pixels compared", a.pixels);
        if (fit) report_pointing(report, *fit, rendered->scene.camera);
        if (!fit) report_shift(report, a);
        report.add("correlation", "correlation", std::optional(a.correlation), "", 5);
        if (!fit)
            report.add("correlation_unshifted", "correlation, not shifted",
                       std::optional(a.correlation_unshifted), "", 5);
        report.add("scale", "scale", fmt::format("{:.6g}", a.scale), a.scale);
        report.add("offset", "offset", fmt::format("{:.6g}", a.offset), a.offset);
        if (rendered) report_i_over_f(report, reference, image, *rendered);
        report.add("residual_rms", "residual, rms", fmt::format("{:.6g}", a.residual_rms), a.residual_rms);
        report.add("residual_percent", "residual of the image's rms",
                   std::optional(100 * a.residual_rms / a.image_rms), "%", 3);
        if (block_ > 0) {
            const BlockDisagreement b = compare_blocks(reference, image, a, block_, 0.01);
            report.add("blocks", "blocks compared", b.blocks);
            report.add("block_worst_percent", "worst block", std::optional(100 * b.worst), "%", 3);
            report.add("block_median_percent", "median block", std::optional(100 * b.median), "%", 3);
        }
        if (!residual_.empty()) write_residual(reference, image, a);
        if (!picture_.empty()) write_picture(reference, image, a, stretch);
        report.print(json_);
        const bool shift_good = max_offset_ <= 0 || std::hypot(a.shift_x_px, a.shift_y_px) <= max_offset_;
        return a.correlation >= min_correlation_ && shift_good ? exit_ok : exit_failure;
    }

private:
    int compare_lists() {
        for (const std::string& row : rows_)
            if (row.find('=') == std::string::npos)
                throw host::UsageError(
                    fmt::format("obscura compare: --rows {}: allowed is COLUMN=VALUE", row));
        reference_list_.rows = image_list_.rows = rows_;
        const StarList reference = read_star_list(reference_, reference_list_);
        const StarList list = read_star_list(image_, image_list_);
        const StarAgreement a = compare_star_lists(reference, list, match_radius_);
        const bool matched = !a.pairs.empty();
        const char* const unit = reference.on_sky ? "arcsec" : "px";
        const auto if_any = [](bool any, double value) { return any ? std::optional(value) : std::nullopt; };
        Report report;
        report.add("reference_stars", "stars of the reference",
                   static_cast<std::int64_t>(reference.stars.size()));
        report.add("stars", "stars", static_cast<std::int64_t>(list.stars.size()));
        report.add("pairs", "matched", static_cast<std::int64_t>(a.pairs.size()));
        report.add("unit", "unit of distances", std::string_view(unit));
        report.add("shift_right", reference.on_sky ? "mean shift, east" : "mean shift, right",
                   if_any(matched, a.shift_right), unit, 4);
        report.add("shift_down", reference.on_sky ? "mean shift, north" : "mean shift, down",
                   if_any(matched, a.shift_down), unit, 4);
        report.add("rms", "distance, rms", if_any(matched, a.rms), unit, 4);
        report.add("rms_shifted", "distance after the mean shift, rms", if_any(matched, a.rms_shifted), unit,
                   4);
        report.add("largest", "distance, largest", if_any(matched, a.largest), unit, 4);
        report.add("reference_column", "brightness of the reference", std::string_view(reference.brightness));
        report.add("column", "brightness", std::string_view(list.brightness));
        report.add("with_magnitude", "pairs with brightness", static_cast<std::int64_t>(a.with_mag));
        report.add("zero_point", "zero point", if_any(a.with_mag > 0, a.zero_point), "mag", 4);
        report.add("zero_point_rms", "scatter about the zero point, rms",
                   if_any(a.with_mag > 0, a.zero_point_rms), "mag", 4);
        report.print(json_);
        if (!pairs_.empty()) write_pairs(reference, list, a);
        const bool near = max_rms_ <= 0 || (matched && a.rms <= max_rms_);
        const bool alike = max_mag_rms_ <= 0 || (a.with_mag > 0 && a.zero_point_rms <= max_mag_rms_);
        return near && alike && a.pairs.size() >= static_cast<std::size_t>(min_pairs_) ? exit_ok
                                                                                       : exit_failure;
    }

    void write_pairs(const StarList& reference, const StarList& list, const StarAgreement& a) const {
        const auto place = [&](double value) { return reference.on_sky ? value / degree : value; };
        std::string text = reference.on_sky
                               ? "reference_line,line,ra_deg,dec_deg,east_arcsec,north_arcsec,mag_offset\n"
                               : "reference_line,line,x_px,y_px,right_px,down_px,mag_offset\n";
        for (const StarPair& pair : a.pairs) {
            const ListedStar& from = reference.stars[pair.reference];
            text += fmt::format("{},{},{:.6f},{:.6f},{:.6f},{:.6f},{}\n", from.line,
                                list.stars[pair.star].line, place(from.x), place(from.y), pair.right,
                                pair.down, pair.mag_offset ? fmt::format("{:.5f}", *pair.mag_offset) : "");
        }
        images::write_text(pairs_, text);
    }

    /// The scene that IMAGE was rendered from.
    struct RenderedScene {
        scene::Scene scene;
        std::unique_ptr<const renderer::Projection> lens;
        double sun_w_m2; ///< irradiance of the Sun in IMAGE's band, at the target
    };

    [[nodiscard]] RenderedScene scene_of(const Image& image) const {
        scene::Scene scene = scene::load_scene(scene_file_);
        const scene::Camera& camera = scene.camera;
        if (image.width != camera.width || image.height != camera.height)
            throw InputError(fmt::format(
                "{}: the camera has {} x {} pixels, {} has {} x {}: allowed is an image of the whole sensor",
                scene_file_, camera.width, camera.height, image_, image.width, image.height));
        const Vec3 target_m = scene.bodies.empty()
                                  ? camera.motion.samples.front().pose.position_m
                                  : scene.bodies.front().motion.samples.front().pose.position_m;
        const double distance_au = length(scene.sun.position_m - target_m) / astronomical_unit_m;
        const double sun_w_m2 = renderer::sun_irradiance_w_m2(band_of(scene)) * scene.sun.irradiance_scale /
                                (distance_au * distance_au);
        auto lens = renderer::make_projection(camera);
        return {std::move(scene), std::move(lens), sun_w_m2};
    }

    /// Band of --image-plane: by the number of the plane or by the name of the channel; else the first.
    [[nodiscard]] SpectralBand band_of(const scene::Scene& scene) const {
        for (std::size_t i = 0; i < scene.bands.size(); ++i) {
            const std::string name = host::band_name(scene.bands[i]);
            if (image_plane_ == std::to_string(i) || image_plane_.ends_with("." + name))
                return scene.bands[i];
        }
        return scene.bands.front();
    }

    void report_shift(Report& report, const Agreement& a) const {
        report.add("shift_x_px", "shift, right", std::optional(a.shift_x_px), "px", 3);
        report.add("shift_y_px", "shift, down", std::optional(a.shift_y_px), "px", 3);
        report.add("shift_px", "shift", std::optional(std::hypot(a.shift_x_px, a.shift_y_px)), "px", 3);
        if (settings_.max_shift_px == 0) return;
        report.add("shift_x_error_px", "standard error, right", finite(a.error_x_px), "px", 3);
        report.add("shift_y_error_px", "standard error, down", finite(a.error_y_px), "px", 3);
        std::string ends;
        const std::string wider = wider_shift(a.limit_px);
        add_end(ends, a.at_limit_x, "shift, right", wider);
        add_end(ends, a.at_limit_y, "shift, down", wider);
        report_ends(report, "shift_at_limit", ends);
    }

    /// The limit of a shift, and how to widen it.
    [[nodiscard]] std::string wider_shift(std::int32_t limit_px) const {
        if (limit_px < searched_px_)
            return fmt::format("{} px, which the size of the images allows", limit_px);
        return limit_px >= widest_shift_px ? fmt::format("{} px, the most that --max-shift allows", limit_px)
                                           : fmt::format("{} px: widen it with --max-shift {}", limit_px,
                                                         std::min(2 * limit_px, widest_shift_px));
    }

    static void add_end(std::string& ends, bool at_limit, std::string_view what, std::string_view limit) {
        if (at_limit)
            ends += fmt::format("{}{} ends at its limit of {}", ends.empty() ? "" : "; ", what, limit);
    }

    /// Says which parameters of a fit end at their limits, so that it has no errors.
    static void report_ends(Report& report, std::string_view key, const std::string& ends) {
        report.add(key, "at a limit of the search", !ends.empty());
        if (!ends.empty())
            report.add(fmt::format("{}_reason", key), "no standard errors",
                       fmt::format("{}. The best fit may lie beyond", ends));
    }

    void report_pointing(Report& report, const PointingFit& fit, const scene::Camera& camera) {
        const auto add = [&](const char* key, const char* label, double angle_rad, double error_rad) {
            report.add(fmt::format("pointing_{}_deg", key), fmt::format("pointing, {}", label),
                       std::optional(angle_rad / degree), "deg", 5);
            report.add(fmt::format("pointing_{}_error_deg", key), fmt::format("standard error, {}", label),
                       finite(error_rad / degree), "deg", 5);
        };
        add("right", "right", fit.pointing.right_rad, fit.error.right_rad);
        add("down", "down", fit.pointing.down_rad, fit.error.down_rad);
        add("roll", "roll (right towards down)", fit.pointing.roll_rad, fit.error.roll_rad);
        std::string ends;
        const std::string wider = wider_shift(fit.limit_px);
        add_end(ends, fit.right_at_limit, "right", wider);
        add_end(ends, fit.down_at_limit, "down", wider);
        add_end(ends, fit.roll_at_limit, "roll",
                max_roll_deg_ >= widest_roll_deg
                    ? fmt::format("{:g} deg, the most that --max-roll allows", max_roll_deg_)
                    : fmt::format("{:g} deg: widen it with --max-roll {:g}", max_roll_deg_,
                                  std::min(2 * max_roll_deg_, widest_roll_deg)));
        report_ends(report, "pointing_at_limit", ends);
        const Quat q = normalized(camera.motion.samples.front().pose.orientation * fit.pointing.turn());
        report.add("orientation", "camera.orientation of the scene, corrected",
                   fmt::format("[{:.12f}, {:.12f}, {:.12f}, {:.12f}]", q.w, q.x, q.y, q.z));
    }

    /// The scale with IMAGE in I/F, and the means of both images over the pixels that are compared.
    void report_i_over_f(Report& report, const Image& reference, const Image& image,
                         const RenderedScene& rendered) const {
        const Image values = i_over_f(
            image, *rendered.lens, rendered.scene.quantity == scene::Quantity::radiance, rendered.sun_w_m2);
        const Agreement a = compare_images(reference, values, settings_);
        double sum = 0, reference_sum = 0;
        std::int64_t pixels = 0;
        for (std::size_t i = 0; i < values.values.size(); ++i) {
            if (std::isnan(values.values[i] + reference.values[i])) continue;
            ++pixels, sum += values.values[i], reference_sum += reference.values[i];
        }
        const auto n = static_cast<double>(std::max<std::int64_t>(pixels, 1));
        report.add("i_over_f", "mean I/F of the image", fmt::format("{:.6g}", sum / n), sum / n);
        report.add("reference_mean", "mean of the reference", fmt::format("{:.6g}", reference_sum / n),
                   reference_sum / n);
        report.add("i_over_f_scale", "scale, image in I/F", fmt::format("{:.6g}", a.scale), a.scale);
        report.add("i_over_f_offset", "offset, image in I/F", fmt::format("{:.6g}", a.offset), a.offset);
    }

    static std::optional<double> finite(double value) {
        return std::isfinite(value) ? std::optional(value) : std::nullopt;
    }

    void write_residual(const Image& reference, const Image& image, const Agreement& a) const {
        const Image residual = residual_image(reference, image, a);
        const std::vector<float> values(residual.values.begin(), residual.values.end());
        images::write_fits_float(residual_, residual.width, residual.height, 1, values, "",
                                 {{"SHIFTX", a.shift_x_px, "[px]"},
                                  {"SHIFTY", a.shift_y_px, "[px]"},
                                  {"SCALE", a.scale, "image = scale * reference + offset"},
                                  {"OFFSET", a.offset, ""}});
    }

    /// Name of a file for a title.
    static std::string title_of(const std::string& file) {
        const std::string name = std::filesystem::path(file).filename().string();
        constexpr std::size_t longest = 32;
        return name.size() <= longest ? name : name.substr(0, longest - 3) + "...";
    }

    /// Reference and image share one grey scale; the colours of the difference reach to four times its rms.
    void write_picture(const Image& reference, const Image& image, const Agreement& a,
                       const host::Stretch& stretch) const {
        const Image residual = residual_image(reference, image, a);
        const auto n = static_cast<std::ptrdiff_t>(image.values.size());
        std::vector<float> both;
        for (const double v : reference.values)
            both.push_back(static_cast<float>(a.scale * v + a.offset));
        both.insert(both.end(), image.values.begin(), image.values.end());
        const host::ToneCurve tone(stretch, both);
        const ColourScale grey{ColourMap::grey, tone.black(), tone.white(), "both images",
                               [tone](double v) { return tone.level(v); }};
        const double reach = std::max(4 * a.residual_rms, 1e-300);
        const ColourScale colours{ColourMap::diverging, -reach, reach, "difference", {}};
        const auto panel = [&](std::string title, const auto& values, const ColourScale& scale) {
            Panel out{std::move(title), reference.width, reference.height, {}, {}, {}};
            for (const auto v : values)
                out.pixels.push_back(scale.colour_of(static_cast<double>(v)));
            return out;
        };
        std::vector<Panel> panels{
            panel(fmt::format("reference {} x {:.4g} {} {:.3g}", title_of(reference_), a.scale,
                              a.offset < 0 ? "-" : "+", std::abs(a.offset)),
                  std::span(both).first(static_cast<std::size_t>(n)), grey),
            panel(fmt::format("image {}", title_of(image_)),
                  std::span(both).last(static_cast<std::size_t>(n)), grey),
            panel(fmt::format("image - reference at shift {:.2f}, {:.2f} px", a.shift_x_px, a.shift_y_px),
                  residual.values, colours)};
        panels[1].scale = grey;
        panels[2].scale = colours;
        draw_panels(panels).write(picture_);
    }

    std::string reference_, image_, reference_plane_, image_plane_, residual_, picture_;
    std::string scene_file_;
    StretchOptions stretch_options_;
    RegistrationSettings settings_;
    double max_roll_deg_ = 1;
    std::int32_t searched_px_ = 0; ///< as --max-shift says
    std::int32_t block_ = 0;
    double min_correlation_ = -1, max_offset_ = 0;
    StarListChoice reference_list_, image_list_;
    std::vector<std::string> rows_;
    std::string pairs_;
    double match_radius_ = 3, max_rms_ = 0, max_mag_rms_ = 0;
    std::int32_t min_pairs_ = 0;
    bool no_offset_ = false, pointing_ = false, json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_compare() {
    return std::make_unique<Compare>();
}

} // namespace obscura::tools
