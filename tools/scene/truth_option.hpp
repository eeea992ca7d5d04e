// SPDX-License-Identifier: Apache-2.0
// Option --truth-table of verbs that make frames.
#pragma once

#include "core/camera/frame.hpp"
#include "core/camera/scene_truth.hpp"
#include "host/command_line.hpp"
#include "images/writers/truth_table.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace obscura::renderer {
class Renderer;
}

namespace obscura::tools {

/// The file of the option, if it is given.
class TruthOption {
public:
    void declare(host::CommandLine& line);
    /// Checks the file's name and folder. Throws OutputError.
    void prepare();
    [[nodiscard]] bool given() const { return file_.has_value(); }

    void add(SceneTruth truth, std::span<const RowTime> rows) { file_->add(std::move(truth), rows); }
    /// Adds the truth of a window of the sensor that was exposed as a whole, without a detector.
    void add(const renderer::Renderer& renderer, Region window, std::uint64_t frame_id, RowTime exposure);
    /// Writes the file, if the option is given. Throws OutputError.
    void write() const;

private:
    std::string name_;
    std::optional<images::TruthTableFile> file_;
};

} // namespace obscura::tools
