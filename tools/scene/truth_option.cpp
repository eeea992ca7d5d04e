// SPDX-License-Identifier: Apache-2.0
#include "tools/scene/truth_option.hpp"

#include "renderer/frame_times.hpp"
#include "renderer/renderer.hpp"
#include "renderer/truth/scene_truth.hpp"

#include <utility>
#include <vector>

namespace obscura::tools {

void TruthOption::declare(host::CommandLine& line) {
    line.option(
        "--truth-table", &name_, "FILE",
        "Also write where every star, body, landmark, limb and terminator is in the pixels of each frame, as a table by frame number; "
        "the name's ending selects the format: .csv or .fits (docs/truth.md)");
}

void TruthOption::prepare() {
    if (!name_.empty()) file_.emplace(name_);
}

void TruthOption::add(const renderer::Renderer& renderer, Region window, std::uint64_t frame_id,
                      RowTime exposure) {
    FrameWindow of_frame;
    of_frame.sensor = window;
    const renderer::FrameTimes times = renderer::frame_times(renderer.scene().camera, window, exposure);
    const std::vector<RowTime>& rows = times.rows;
    renderer::TruthRequest request;
    request.windows = {&of_frame, 1};
    request.rows = rows;
    if (times.pixels) request.pixel_times = {&times.pixels, 1};
    request.frame_id = frame_id;
    SceneTruth truth;
    renderer.list_truth(request, truth);
    add(std::move(truth), rows);
}

void TruthOption::write() const {
    if (file_) file_->write();
}

} // namespace obscura::tools
