// SPDX-License-Identifier: Apache-2.0
// Truth table of a frame: where stars, bodies, limbs, terminators, landmarks, craters and boulders are in its
// pixels.
#pragma once

#include "core/geometry.hpp"
#include "core/text/enum_names.hpp"
#include "core/time.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <string_view>
#include <vector>

namespace obscura {

/// Kind of object of an entry.
enum class TruthKind : std::uint8_t {
    star,
    body,       ///< origin of the body frame; also the Sun
    landmark,   ///< named point of a body
    limb,       ///< point of a body's outline
    terminator, ///< point of a body where the centre of the Sun is on the horizon
    galaxy,     ///< centre of an extended object at infinite distance
    crater,     ///< middle of a crater that procedural detail made: of its floor
    boulder,    ///< middle of a boulder that procedural detail made: of its top
};
constexpr auto enum_names(TruthKind /*type*/) {
    return std::array{EnumName{TruthKind::star, "star"},
                      EnumName{TruthKind::body, "body"},
                      EnumName{TruthKind::landmark, "landmark"},
                      EnumName{TruthKind::limb, "limb"},
                      EnumName{TruthKind::terminator, "terminator"},
                      EnumName{TruthKind::galaxy, "galaxy"},
                      EnumName{TruthKind::crater, "crater"},
                      EnumName{TruthKind::boulder, "boulder"}};
}

/// Visibility of an object in a frame.
enum class TruthVisibility : std::uint8_t {
    visible,
    partly,  ///< for a part of the exposure, or a part of its disc
    hidden,  ///< behind a body, or on the far side of its own
    outside, ///< not on the delivered pixels
};
constexpr auto enum_names(TruthVisibility /*type*/) {
    return std::array{
        EnumName{TruthVisibility::visible, "visible"}, EnumName{TruthVisibility::partly, "partly"},
        EnumName{TruthVisibility::hidden, "hidden"}, EnumName{TruthVisibility::outside, "outside"}};
}

/// Name of fixed size, so that truth tables need no heap for each; longer names are cut.
class TruthName {
public:
    static constexpr std::size_t size = 32;

    void set(std::string_view text) {
        text_.fill('\0');
        std::copy_n(text.begin(), std::min(text.size(), size - 1), text_.begin());
    }
    [[nodiscard]] std::string_view view() const {
        return {text_.data(),
                static_cast<std::size_t>(std::find(text_.begin(), text_.end(), '\0') - text_.begin())};
    }
    /// Zero terminated, zeros after the text.
    [[nodiscard]] const std::array<char, size>& bytes() const { return text_; }

private:
    std::array<char, size> text_{};
};

/// An object in one window of a frame. Quantities that are not known are NaN.
struct TruthEntry {
    static constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

    TruthKind kind = TruthKind::star;
    TruthVisibility visibility = TruthVisibility::visible;
    /// Its brightest pixel reaches full well or the end of the ADC's range, by its own light alone.
    bool saturated = false;
    /// Landmarks, limb points, craters and boulders: the centre of the Sun is above the horizon.
    bool lit = true;
    std::uint16_t window = 0;
    std::int32_t object = 0; ///< index of the star or body in the scene; the Sun comes after the bodies
    /// Landmark: its index; limb and terminator: number along the curve; crater and boulder: number on its
    /// body in this frame, the largest in the picture first.
    std::int32_t item = 0;
    TruthName name; ///< stars have none; crater and boulder: 16 hexadecimal digits, the same in all frames
    /// Centroid of its light in the composed image, px: centre of pixel (0, 0) at (0, 0). All effects of the
    /// image are in it.
    double x_px = unknown, y_px = unknown;
    double psf_x_px = 0, psf_y_px = 0; ///< the part of it that the asymmetry of the PSF makes
    Time time;                         ///< mid-exposure of the row on which it lands
    std::int64_t exposure_ns = 0;      ///< of that row
    double range_m = unknown;          ///< from the camera, at `time`; infinite for stars
    double visible_share = 1;          ///< of its light, or of its disc
    double magnitude_v = unknown;      ///< stars and galaxies
    double irradiance_w_m2 = unknown;  ///< at the entrance pupil, sum of the bands; landmarks: of its pixel
    double signal_e = unknown;         ///< expected electrons in all its pixels
    double peak_e = unknown;           ///< expected electrons in its brightest pixel; landmarks: in its pixel
    double snr = unknown;              ///< of a fit of its image, see docs/truth.md
    /// Landmark, crater and boulder: planetocentric, longitude from -180 to 180; not of planes.
    double latitude_deg = unknown, longitude_deg = unknown;
    double diameter_m = unknown;             ///< crater and boulder
    Vec3 point_m{unknown, unknown, unknown}; ///< landmark, crater and boulder: in the body frame
};

/// Pose of the camera or of a body as the camera sees it (light time), at mid-exposure of the frame.
struct TruthPose {
    TruthName name;
    Pose pose; ///< own axes to inertial
    Vec3 sun;  ///< unit, own axes: from its origin to the Sun
};

/// Truth table of one frame.
struct SceneTruth {
    std::uint64_t frame_id = 0;
    Time mid_exposure; ///< half way between the first reset and the last read
    Vec3 sun_position_m;
    std::vector<TruthPose> poses; ///< the camera, then all bodies
    /// Bodies with the Sun, landmarks, stars, sky objects, limbs with terminators, craters and boulders.
    std::vector<TruthEntry> entries;
    std::uint64_t entries_left_out = 0; ///< further ones, for which there was no room
};

} // namespace obscura
