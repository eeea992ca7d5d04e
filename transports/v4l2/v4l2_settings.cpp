#include "transports/v4l2/v4l2_settings.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

namespace obscura::transports {

V4l2Format v4l2_format_named(std::string_view name) {
    if (name == "GREY") return V4l2Format::grey;
    if (name == "Y10") return V4l2Format::y10;
    if (name == "Y12") return V4l2Format::y12;
    if (name == "Y14") return V4l2Format::y14;
    if (name == "Y16") return V4l2Format::y16;
    throw ConfigError(fmt::format("v4l2: format {} is unknown, allowed are GREY, Y10, Y12, Y14, Y16", name));
}

V4l2Io v4l2_io_named(std::string_view name) {
    if (name == "auto") return V4l2Io::automatic;
    if (name == "mmap") return V4l2Io::mmap;
    if (name == "write") return V4l2Io::write;
    throw ConfigError(fmt::format("v4l2: io {} is unknown, allowed are auto, mmap, write", name));
}

} // namespace obscura::transports
