// SPDX-License-Identifier: Apache-2.0
// Verb `obscura compare`: sub-pixel registration, correlation and residual of two images.
#include "images/image.hpp"
#include "images/writers/fits.hpp"
#include "images/writers/png.hpp"
#include "tools/support/preview.hpp"
#include "tools/support/registration.hpp"
#include "tools/support/report.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::tools {
namespace {

class Compare final : public Verb {
public:
    void declare(CommandLine& line) override {
        line.summary = "compares two images: shift, scale, correlation, residual";
        line.description =
            "Registers two images of the same size: finds the sub-pixel shift of the highest correlation "
            "and fits IMAGE = scale * REFERENCE + offset at that shift by least squares; prints shift, "
            "scale, offset, Pearson correlation and residual. Reads FITS, PNG, OpenEXR and PDS3 (attached "
            "label, or the detached label as the file). Pixels that are NaN in either image are left out. "
            "The standard error of the shift is estimated from the scatter between blocks of the image; "
            "none is given where the correlation has no maximum within --max-shift, because the shift is "
            "then undetermined.";
        line.positional("REFERENCE", &reference_, "Reference image");
        line.positional("IMAGE", &image_, "Image to compare with the reference");
        line.option(
            "--reference-plane", &reference_plane_, "N|NAME",
            "Plane number (from 0) or OpenEXR channel name to read from REFERENCE (default: the first)");
        line.option("--image-plane", &image_plane_, "N|NAME",
                    "Plane number (from 0) or OpenEXR channel name to read from IMAGE (default: the first)");
        line.number("--max-shift", &settings_.max_shift_px, "PX",
                    "Largest shift to search for in each direction, in pixels; 0: compare unshifted", 0,
                    1024);
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
        line.option("--picture", &picture_, "FILE.png",
                    "Write reference, image and residual side by side as an 8-bit PNG");
        line.flag("--json", json_, "Print one JSON object instead of a table");
        line.examples = {
            "obscura compare flight.fit render.fits --min-correlation 0.8",
            "obscura compare a.exr b.exr --reference-plane irradiance.400-900nm --picture ab.png",
        };
    }

    int run() override {
        const Image reference = images::read_image(reference_, reference_plane_);
        const Image image = images::read_image(image_, image_plane_);
        settings_.with_offset = !no_offset_;
        const Agreement a = compare_images(reference, image, settings_);
        Report report;
        report.add("width", "width", static_cast<std::int64_t>(reference.width));
        report.add("height", "height", static_cast<std::int64_t>(reference.height));
        report.add("pixels", "pixels compared", a.pixels);
        report.add("shift_x_px", "shift, right", std::optional(a.shift_x_px), "px", 3);
        report.add("shift_y_px", "shift, down", std::optional(a.shift_y_px), "px", 3);
        report.add("shift_px", "shift", std::optional(std::hypot(a.shift_x_px, a.shift_y_px)), "px", 3);
        if (settings_.max_shift_px > 0) {
            const auto error = [](double px) { return std::isfinite(px) ? std::optional(px) : std::nullopt; };
            report.add("shift_x_error_px", "standard error, right", error(a.error_x_px), "px", 3);
            report.add("shift_y_error_px", "standard error, down", error(a.error_y_px), "px", 3);
        }
        report.add("correlation", "correlation", std::optional(a.correlation), "", 5);
        report.add("correlation_unshifted", "correlation, not shifted",
                   std::optional(a.correlation_unshifted), "", 5);
        report.add("scale", "scale", fmt::format("{:.6g}", a.scale), a.scale);
        report.add("offset", "offset", fmt::format("{:.6g}", a.offset), a.offset);
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
        if (!picture_.empty()) write_picture(reference, image, a);
        report.print(json_);
        const bool shift_good = max_offset_ <= 0 || std::hypot(a.shift_x_px, a.shift_y_px) <= max_offset_;
        return a.correlation >= min_correlation_ && shift_good ? exit_ok : exit_failure;
    }

private:
    void write_residual(const Image& reference, const Image& image, const Agreement& a) const {
        const Image residual = residual_image(reference, image, a);
        const std::vector<float> values(residual.values.begin(), residual.values.end());
        images::write_fits_float(residual_, residual.width, residual.height, 1, values, "",
                                 {{"SHIFTX", a.shift_x_px, "[px]"},
                                  {"SHIFTY", a.shift_y_px, "[px]"},
                                  {"SCALE", a.scale, "image = scale * reference + offset"},
                                  {"OFFSET", a.offset, ""}});
    }

    /// Reference and image share one contrast stretch; the residual is centred on mid grey, one rms being a
    /// quarter of the range to black or white.
    void write_picture(const Image& reference, const Image& image, const Agreement& a) const {
        const Image residual = residual_image(reference, image, a);
        constexpr std::int32_t gap = 4;
        const std::int32_t width = 3 * reference.width + 2 * gap;
        std::vector<std::uint8_t> out(
            static_cast<std::size_t>(width) * static_cast<std::size_t>(reference.height), 255);
        std::vector<float> both;
        for (const double v : reference.values)
            both.push_back(static_cast<float>(std::isnan(v) ? 0 : a.scale * v + a.offset));
        for (const double v : image.values)
            both.push_back(static_cast<float>(std::isnan(v) ? 0 : v));
        const std::vector<std::uint8_t> grey = stretched(both);
        const std::size_t plane = reference.values.size();
        for (std::int32_t y = 0; y < reference.height; ++y)
            for (std::int32_t x = 0; x < reference.width; ++x) {
                const auto from = static_cast<std::size_t>(y) * static_cast<std::size_t>(reference.width) +
                                  static_cast<std::size_t>(x);
                const auto to = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                static_cast<std::size_t>(x);
                const double r = std::isnan(residual.values[from]) ? 0 : residual.values[from];
                const double level = 128 + 32 * r / std::max(a.residual_rms, 1e-300);
                out[to] = grey[from];
                out[to + static_cast<std::size_t>(reference.width + gap)] = grey[plane + from];
                out[to + static_cast<std::size_t>(2 * (reference.width + gap))] =
                    static_cast<std::uint8_t>(std::clamp(level, 0.0, 255.0));
            }
        images::write_png8(picture_, width, reference.height, out, {});
    }

    std::string reference_, image_, reference_plane_, image_plane_, residual_, picture_;
    RegistrationSettings settings_;
    std::int32_t block_ = 0;
    double min_correlation_ = -1, max_offset_ = 0;
    bool no_offset_ = false, json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_compare() {
    return std::make_unique<Compare>();
}

} // namespace obscura::tools
