// SPDX-License-Identifier: Apache-2.0
// Look-ups of a model of kind "texture", for one set of parameters.
#pragma once

#include "models/kinds/look_ups.hpp"
#include "models/kinds/model_parameters.hpp"

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

namespace obscura::models {

/// Image of a texture that a model reads.
struct TextureImage {
    double width = 0, height = 0; ///< texels; 0: there is none
    bool grey = true;             ///< all channels are the same
};

struct TextureParameters : ModelParameters {
    std::size_t bands = 1; ///< each is a channel, in fours
    /// For each of Model::parameters(), and behind them that of the argument `tex`.
    std::vector<TextureImage> images{};
};

/// Immutable; thread-safe. A texture is read by its coordinates (lookup2D) or, if the model has lookup3D, by
/// the position on the body.
///
/// Inputs are rows, lane by lane: place (u and v, or x, y and z in metres), level of detail, width of the
/// sample in metres, and four for each read of an image, which are the bands of its group.
class TextureProgram {
public:
    enum Row : std::size_t { row_x, row_y, row_z, row_level, row_sample_m, first_read_row };

    /// Throws ConfigError `file:line:column: what`.
    TextureProgram(std::shared_ptr<const Model> model, const TextureParameters& parameters);

    /// Values as the text gives them: NaN is no data. r: rows of outputs(). `lanes` is a multiple of
    /// Program::lane_step. Real-time safe.
    void evaluate(const double* const* rows, double* const* r, std::size_t lanes) const noexcept;
    /// One for each band, or one that is the same in all.
    [[nodiscard]] std::size_t outputs() const noexcept { return outputs_; }
    [[nodiscard]] std::size_t rows() const noexcept { return first_read_row + 4 * places_.list().size(); }
    [[nodiscard]] const std::vector<LookUp>& reads() const noexcept { return places_.list(); }
    /// Place of a read that is not own_place. Real-time safe.
    void read_at(std::size_t read, const double* const* rows, double* const* at,
                 std::size_t lanes) const noexcept {
        places_.run(read, rows, at, lanes);
    }

    /// Whether it is read by positions.
    [[nodiscard]] bool by_position() const noexcept { return by_position_; }
    /// Width and height that the model says, or those of its image; 1 without.
    [[nodiscard]] std::array<double, 2> size() const noexcept { return size_; }
    [[nodiscard]] const Program& program() const noexcept { return *bound_.program; }
    [[nodiscard]] const std::string& why_interpreted() const noexcept { return bound_.why_interpreted; }
    [[nodiscard]] const Model& model() const noexcept { return *model_; }
    [[nodiscard]] Place place() const noexcept { return at_; }

    static constexpr std::size_t max_rows = 40;

private:
    void compile(const TextureParameters& parameters);
    void find_size(const TextureParameters& parameters);

    std::shared_ptr<const Model> model_;
    Place at_;
    bool by_position_;
    std::array<double, 2> size_{1, 1};
    BoundProgram bound_;
    LookUpPlaces places_;
    std::size_t outputs_ = 1;
};

} // namespace obscura::models
