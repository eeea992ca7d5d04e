// SPDX-License-Identifier: Apache-2.0
// Draws on a display through the kernel's own driver, by DRM requests alone:
//     drm_draw /dev/dri/cardN FRAMES
// Sets the first mode of the first connector with an 8-bit grey buffer (R8), draws FRAMES pictures, whole
// ones and patches in turn, and prints the CRC-32 of the buffer after the last.
#include <fcntl.h>
#include <fmt/format.h>
#include <libdrm/drm.h>
#include <libdrm/drm_fourcc.h>
#include <libdrm/drm_mode.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>
#include <zlib.h>

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

namespace {

int card = -1;

template<typename T>
void ask(unsigned long request, T& argument, const char* what) {
    if (::ioctl(card, request, &argument) == 0) return;
    fmt::print("{}: {}\n", what, std::strerror(errno));
    std::exit(1);
}

template<typename T>
std::uint64_t pointer(std::vector<T>& v) {
    return reinterpret_cast<std::uintptr_t>(v.data());
}

} // namespace

int main(int argc, char* argv[]) {
    if (argc != 3) return 64;
    card = ::open(argv[1], O_RDWR | O_CLOEXEC);
    if (card < 0) {
        fmt::print("{}: {}\n", argv[1], std::strerror(errno));
        return 1;
    }
    drm_mode_card_res resources{};
    ask(DRM_IOCTL_MODE_GETRESOURCES, resources, "resources");
    std::vector<std::uint32_t> crtcs(resources.count_crtcs), connectors(resources.count_connectors),
        encoders(resources.count_encoders), framebuffers(resources.count_fbs);
    resources.crtc_id_ptr = pointer(crtcs);
    resources.connector_id_ptr = pointer(connectors);
    resources.encoder_id_ptr = pointer(encoders);
    resources.fb_id_ptr = pointer(framebuffers);
    ask(DRM_IOCTL_MODE_GETRESOURCES, resources, "resources");

    drm_mode_get_connector connector{};
    connector.connector_id = connectors.at(0);
    ask(DRM_IOCTL_MODE_GETCONNECTOR, connector, "connector");
    std::vector<drm_mode_modeinfo> modes(connector.count_modes);
    std::vector<std::uint32_t> property_ids(connector.count_props),
        connector_encoders(connector.count_encoders);
    std::vector<std::uint64_t> property_values(connector.count_props);
    connector.modes_ptr = pointer(modes);
    connector.props_ptr = pointer(property_ids);
    connector.prop_values_ptr = pointer(property_values);
    connector.encoders_ptr = pointer(connector_encoders);
    ask(DRM_IOCTL_MODE_GETCONNECTOR, connector, "connector");
    const drm_mode_modeinfo mode = modes.at(0);

    drm_mode_create_dumb dumb{};
    dumb.width = mode.hdisplay;
    dumb.height = mode.vdisplay;
    dumb.bpp = 8;
    ask(DRM_IOCTL_MODE_CREATE_DUMB, dumb, "buffer");
    drm_mode_fb_cmd2 framebuffer{};
    framebuffer.width = mode.hdisplay;
    framebuffer.height = mode.vdisplay;
    framebuffer.pixel_format = DRM_FORMAT_R8;
    framebuffer.handles[0] = dumb.handle;
    framebuffer.pitches[0] = dumb.pitch;
    ask(DRM_IOCTL_MODE_ADDFB2, framebuffer, "R8 framebuffer");
    drm_mode_map_dumb map{};
    map.handle = dumb.handle;
    ask(DRM_IOCTL_MODE_MAP_DUMB, map, "mapping");
    auto* pixels = static_cast<std::uint8_t*>(
        ::mmap(nullptr, dumb.size, PROT_READ | PROT_WRITE, MAP_SHARED, card, static_cast<off_t>(map.offset)));
    if (pixels == MAP_FAILED) return 1;

    const auto draw = [&](std::uint32_t x0, std::uint32_t y0, std::uint32_t x1, std::uint32_t y1,
                          std::uint32_t seed) {
        for (std::uint32_t y = y0; y < y1; ++y)
            for (std::uint32_t x = x0; x < x1; ++x)
                pixels[y * dumb.pitch + x] =
                    static_cast<std::uint8_t>(seed % 2 == 0 ? x * 3 + y * 5 + seed : y / 4 + seed);
    };
    draw(0, 0, mode.hdisplay, mode.vdisplay, 0);
    drm_mode_crtc crtc{};
    crtc.crtc_id = crtcs.at(0);
    crtc.fb_id = framebuffer.fb_id;
    crtc.set_connectors_ptr = pointer(connectors);
    crtc.count_connectors = 1;
    crtc.mode = mode;
    crtc.mode_valid = 1;
    ask(DRM_IOCTL_MODE_SETCRTC, crtc, "mode setting");

    const int frames = std::atoi(argv[2]);
    for (int i = 1; i <= frames; ++i) {
        drm_clip_rect clip{0, 0, mode.hdisplay, mode.vdisplay};
        if (i % 2 == 1)
            clip = {static_cast<std::uint16_t>(3 * i), static_cast<std::uint16_t>(2 * i),
                    static_cast<std::uint16_t>(mode.hdisplay / 2),
                    static_cast<std::uint16_t>(mode.vdisplay / 2 + i)};
        draw(clip.x1, clip.y1, clip.x2, clip.y2, static_cast<std::uint32_t>(i));
        drm_mode_fb_dirty_cmd dirty{};
        dirty.fb_id = framebuffer.fb_id;
        dirty.num_clips = 1;
        dirty.clips_ptr = reinterpret_cast<std::uintptr_t>(&clip);
        ask(DRM_IOCTL_MODE_DIRTYFB, dirty, "update");
    }
    uLong crc = ::crc32(0, nullptr, 0);
    for (std::uint32_t y = 0; y < mode.vdisplay; ++y)
        crc = ::crc32(crc, pixels + y * dumb.pitch, mode.hdisplay);
    fmt::print("drew {} pictures of {}x{}, screen {:08x}\n", frames, mode.hdisplay, mode.vdisplay, crc);
    std::fflush(stdout);
    // Closing the card turns the display off and its picture black: readers must read before.
    std::getchar();
    return 0;
}
