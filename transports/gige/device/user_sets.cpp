// The part of Device that saves and loads user sets.
#include "transports/gige/device/device.hpp"
#include "transports/gige/device/device_words.hpp"
#include "transports/gige/registers/features.hpp"
#include "transports/gige/wire/bytes.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <charconv>
#include <fstream>
#include <sstream>

namespace obscura::transports::gige {
namespace {

/// Registers that belong to the connection or act when written, not to the camera's settings.
bool belongs_to_user_set(const Register& r) {
    if (r.access != Access::read_write || r.bytes != 4) return false;
    if (r.address == reg::stream_packet_delay || r.address == reg::heartbeat_timeout) return true;
    if (r.address < feature::sensor_width || r.address >= feature::xml_file) return false;
    // The sequencer's sets are written in its own mode only; loading a user set switches it off.
    if (r.address >= feature::sequencer_mode && r.address < feature::sequencer_end) return false;
    return r.address != feature::user_set_selector && r.address != feature::user_set_default &&
           r.address != feature::test_pending_ack;
}

bool binned(const std::string& text) {
    std::istringstream lines(text);
    lines >> std::hex;
    for (std::uint32_t address = 0, value = 0; lines >> address >> value;)
        if ((address == feature::binning_horizontal || address == feature::binning_vertical) && value > 1)
            return true;
    return false;
}

constexpr std::uint32_t set_default = 0, set_user_1 = 1;

} // namespace

std::string Device::saved_features() const {
    std::string text;
    for (const Register& r : bank_.table()) {
        std::uint32_t value = 0;
        if (belongs_to_user_set(r) && bank_.read_word(r.address, value) == Status::success)
            text += fmt::format("{:#x} {:#x}\n", r.address, value);
    }
    return text;
}

Status Device::load_features(const std::string& text) {
    if (control_.acquiring()) return Status::write_protect;
    // A binned picture comes in one part, and that is the stream's, not the set's.
    const bool multipart = (bank_.peek(reg::stream_configuration) & sccfg::multipart) != 0;
    if (multipart && binned(text)) return Status::write_protect;
    publish_sequence({});
    sequencer_configuring_ = false;
    bank_.write_word(feature::exposure_auto, 0); // or ExposureTime could not be written
    // Regions but the first go off and offsets to 0, so that any width and height fit; what does not fit the
    // sensor is left alone.
    for (std::uint32_t i = region_count(); i-- > 1;)
        bank_.write_word(feature::regions + i * feature::region_stride + feature::region::mode, 0);
    for (std::uint32_t i = 0; i < region_count(); ++i) {
        const std::uint32_t base = feature::regions + i * feature::region_stride;
        bank_.write_word(base + feature::region::offset_x, 0);
        bank_.write_word(base + feature::region::offset_y, 0);
    }
    // Several reads of one window cannot be binned.
    bank_.write_word(feature::regions + feature::region::sampling, 0);
    std::istringstream lines(text);
    lines >> std::hex;
    for (std::uint32_t address = 0, value = 0; lines >> address >> value;) {
        const Register* r = bank_.find(address);
        if (r != nullptr && r->address == address && belongs_to_user_set(*r))
            bank_.write_word(address, value);
    }
    return Status::success;
}

void Device::add_user_sets() {
    bank_.add({.name = "UserSetSelector",
               .address = feature::user_set_selector,
               .access = Access::read_write,
               .maximum = set_user_1});
    command("UserSetLoad", feature::user_set_load, [this] {
        return load_features(bank_.peek(feature::user_set_selector) == set_default ? default_set_
                                                                                   : user_set_1_);
    });
    command("UserSetSave", feature::user_set_save, [this] {
        if (bank_.peek(feature::user_set_selector) == set_default) return Status::write_protect;
        user_set_1_ = saved_features();
        return write_state_file() ? Status::success : Status::error;
    });
    bank_.add({.name = "UserSetDefault",
               .address = feature::user_set_default,
               .access = Access::read_write,
               .maximum = set_user_1,
               .written = [this] { write_state_file(); }});
}

void Device::read_state_file() {
    if (settings_.state_file.empty()) return;
    std::ifstream file(settings_.state_file);
    std::string name, line;
    std::uint32_t at_start = set_default;
    while (std::getline(file, line)) {
        if (line.rfind("name ", 0) == 0) {
            name = line.substr(5);
        } else if (line == "default 1") {
            at_start = set_user_1;
        } else if (line.rfind("0x", 0) == 0) {
            user_set_1_ += line + "\n";
        }
    }
    if (!name.empty()) bank_.set_text(reg::user_name, name);
    bank_.poke(feature::user_set_default, at_start);
    if (at_start == set_user_1) load_features(user_set_1_);
}

bool Device::write_state_file() const {
    if (settings_.state_file.empty()) return true;
    // Written beside and renamed: whatever happens, the file holds the old sets or the new ones.
    const std::string beside = settings_.state_file + ".new";
    const std::string text = fmt::format("name {}\ndefault {}\n{}", bank_.text(reg::user_name),
                                         bank_.peek(feature::user_set_default), user_set_1_);
    const int fd = open(beside.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (fd < 0) return false;
    const bool written =
        ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size()) && fsync(fd) == 0;
    close(fd);
    return written && std::rename(beside.c_str(), settings_.state_file.c_str()) == 0;
}

} // namespace obscura::transports::gige
