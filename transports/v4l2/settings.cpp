// SPDX-License-Identifier: Apache-2.0
#include "transports/v4l2/settings.hpp"

#include "transports/v4l2/v4l2_output.hpp"

namespace obscura::transports {

config::Section section_of(V4l2Settings& s) {
    using config::key;
    return {
        .name = V4l2Settings::kind,
        .help = "Transport that feeds a Linux video output node.",
        .keys =
            {
                key("enabled", &s.enabled).help("Feed a Linux video output node (v4l2loopback or another)"),
                key("device", &s.device).help("Absolute path of the video output node"),
                key("format", &s.format)
                    .help("Pixel format of the node; "
                          "Y formats: 16-bit words with the digital number aligned to the low bit; "
                          "GREY: its high 8 bits"),
                key("io", &s.io)
                    .help(
                        "How images reach the driver; "
                        "auto: mmap, which carries trigger time stamps, unless the driver returns buffers out of order"),
                key("buffers", &s.buffers).range(2, 32).help("Buffers requested from the driver for mmap"),
                key("queue_frames", &s.queue_frames)
                    .range(1, 256)
                    .help("Frames that may wait for the node; further ones are dropped and counted"),
                key("frame_counter", &s.frame_counter)
                    .help("Write the frame number into the first four pixels, one byte each, lowest first"),
                key("required", &s.required)
                    .help("Refuse to start without the node; false: wait for the node"),
            },
        .check =
            [&s](const config::ReadTable& table) {
                if (s.enabled && s.device.find('/') != 0)
                    table.refuse("device", "the absolute path of a video node is wanted, as in /dev/video10");
            },
    };
}

std::vector<Identity> identities_of(const V4l2Settings& s) {
    return {{"device", s.device, s.device, "video node"}};
}

std::size_t frames_held_by(const V4l2Settings& s) {
    return s.queue_frames;
}

std::unique_ptr<Transport> make_transport(const V4l2Settings& s, const TransportContext& context) {
    const CameraSettings camera = context.control.settings();
    const ImageSize image = composed_size(camera);
    V4l2Context made_with;
    made_with.width = image.width;
    made_with.height = image.height;
    made_with.bits_per_pixel = context.sensor.adc_bits;
    made_with.frame_rate_hz = camera.frame_trigger.enabled ? context.trigger_rate_hz : camera.frame_rate_hz;
    made_with.thread = context.display;
    return std::make_unique<V4l2Output>(s, made_with);
}

} // namespace obscura::transports
