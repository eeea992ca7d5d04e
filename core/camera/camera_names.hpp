// SPDX-License-Identifier: Apache-2.0
// SFNC names of the camera settings whose enumerations have none of their own.
#pragma once

#include "core/camera/camera.hpp"
#include "core/camera/image_pattern.hpp"
#include "core/camera/trigger.hpp"
#include "core/text/enum_names.hpp"

#include <array>

namespace obscura {

constexpr auto enum_names(AcquisitionMode /*type*/) {
    return std::array{EnumName{AcquisitionMode::continuous, "Continuous"},
                      EnumName{AcquisitionMode::single_frame, "SingleFrame"},
                      EnumName{AcquisitionMode::multi_frame, "MultiFrame"}};
}

constexpr auto enum_names(ExposureAuto /*type*/) {
    return std::array{EnumName{ExposureAuto::off, "Off"}, EnumName{ExposureAuto::once, "Once"},
                      EnumName{ExposureAuto::continuous, "Continuous"}};
}

constexpr auto enum_names(TriggerOverlap /*type*/) {
    return std::array{EnumName{TriggerOverlap::off, "Off"}, EnumName{TriggerOverlap::readout, "ReadOut"},
                      EnumName{TriggerOverlap::previous_frame, "PreviousFrame"}};
}

constexpr auto enum_names(ImagePattern /*type*/) {
    using P = ImagePattern;
    return std::array{EnumName{P::off, "Off"},
                      EnumName{P::black, "Black"},
                      EnumName{P::white, "White"},
                      EnumName{P::horizontal_ramp, "GreyHorizontalRamp"},
                      EnumName{P::vertical_ramp, "GreyVerticalRamp"},
                      EnumName{P::horizontal_ramp_moving, "GreyHorizontalRampMoving"},
                      EnumName{P::vertical_ramp_moving, "GreyVerticalRampMoving"},
                      EnumName{P::frame_counter, "FrameCounter"}};
}

} // namespace obscura
