// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: tables from files: stars, trajectories, joints, timing files, PSF and sensor maps, the
// stimulator's calibration, PDS3 labels, truth tables, headers of pictures. Whatever a file holds, it is read
// or refused in one line.
//
// Input: a byte that chooses the reader, then the file.
#include "core/error.hpp"
#include "images/readers/header_cards.hpp"
#include "images/readers/pds_label.hpp"
#include "images/readers/truth_table_reader.hpp"
#include "renderer/camera/psf_file.hpp"
#include "renderer/scene/star_catalogue.hpp"
#include "renderer/scene/trajectory.hpp"
#include "sensors/fits_map.hpp"
#include "tests/fuzz/memory_file.hpp"
#include "tests/fuzz/scratch_folder.hpp"
#include "tools/timing/timing_report.hpp"
#include "transports/stimulator/calibration_table.hpp"

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

using namespace obscura;
using test::require;

namespace {

void timing(const std::string& text) {
    std::istringstream in(text);
    const tools::TimingFile file = tools::read_timing(in, "fuzz.csv");
    require(!tools::timing_text(file).empty() && !tools::timing_csv(file).empty());
    const std::string picture = tools::timing_svg(file);
    require(picture.find("<script") == std::string::npos);
}

void psf(const std::filesystem::path& file) {
    for (const renderer::PsfImage& image : renderer::read_psf_file(file))
        require(image.width >= 3 && image.height >= 3 && image.sum() > 0 &&
                image.values.size() ==
                    static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
}

void map(const std::filesystem::path& file) {
    for (const float v : sensors::read_fits_map(file, 2, 2, 0))
        require(v >= 0 && std::isfinite(v));
}

void truth(const std::filesystem::path& file) {
    const images::TruthLines table = images::read_truth_table(file, "");
    for (const std::vector<std::string>& line : table.lines)
        require(line.size() == table.columns.size());
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    // A header may promise a large table in few bytes: honest, but no use here.
    if (size < 1 || size > 65536) return 0;
    const test::MemoryFile memory(data + 1, size - 1);
    const std::filesystem::path file = memory.path();
    try {
        switch (data[0] % 11) {
        case 0:
            (void)scene::read_stars(file, 6);
            break;
        case 1:
            for (const scene::TimedPose& sample : scene::read_trajectory(file).samples)
                require(is_finite(sample.pose.position_m));
            break;
        case 2:
            (void)scene::read_joint_table(file, "angle_deg", 0.017);
            break;
        case 3:
            timing({reinterpret_cast<const char*>(data) + 1, size - 1});
            break;
        case 4:
            psf(file);
            break;
        case 5:
            map(file);
            break;
        case 6:
            (void)transports::read_calibration(file);
            break;
        case 8: // FITS
            truth(file);
            break;
        case 9: {
            static const test::ScratchFolder folder;
            truth(folder.write("fuzz.csv", {reinterpret_cast<const char*>(data) + 1, size - 1}));
            break;
        }
        case 10:
            (void)images::read_header_cards(file);
            break;
        default: {
            const images::PdsLabel label(file);
            if (label.has("^IMAGE")) require(!label.list("^IMAGE").empty() || label.unit("^IMAGE").empty());
        }
        }
    } catch (const Error& error) {
        require(std::string(error.what()).find('\n') == std::string::npos);
    }
    return 0;
}
