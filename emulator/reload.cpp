#include "emulator/reload.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <string>

namespace obscura::emulator {
namespace {

// "section.key" -> the text behind "=", comments left out. Elements of arrays of tables are numbered:
// "camera[1].gige.faults[0].kind".
std::map<std::string, std::string> printed_values(const config::Config& config) {
    std::map<std::string, std::string> values;
    std::map<std::string, int> elements; // of each array so far
    std::istringstream in(config::print(config));
    std::string line, section, last;
    const auto full_name = [&](std::string name) {
        // The only array with tables inside.
        const int cameras = elements["camera"];
        if (cameras > 0 && name.rfind("camera.", 0) == 0)
            name = fmt::format("camera[{}].{}", cameras - 1, name.substr(7));
        return name;
    };
    while (std::getline(in, line)) {
        if (line.empty() || line[0] == '#') continue;
        if (line[0] == ' ') { // a long value goes on
            values[last] += line;
            continue;
        }
        if (line.rfind("[[", 0) == 0) {
            const std::string name = full_name(line.substr(2, line.find(']') - 2));
            section = fmt::format("{}[{}]", name, elements[name]++);
            continue;
        }
        if (line[0] == '[') {
            section = full_name(line.substr(1, line.find(']') - 1));
            continue;
        }
        const std::size_t equals = line.find('=');
        if (equals == std::string::npos) continue;
        last = section + "." + line.substr(0, line.find_last_not_of(' ', equals - 1) + 1);
        values[last] = line.substr(equals + 1);
    }
    return values;
}

} // namespace

std::vector<std::string> changed_keys(const config::Config& before, const config::Config& after) {
    const auto old_values = printed_values(before), new_values = printed_values(after);
    std::vector<std::string> changed;
    for (const auto& [key, value] : new_values) {
        const auto old = old_values.find(key);
        if (old == old_values.end() || old->second != value) changed.push_back(key);
    }
    for (const auto& [key, value] : old_values)
        if (new_values.find(key) == new_values.end()) changed.push_back(key);
    return changed;
}

std::uint64_t scene_fingerprint(const std::filesystem::path& scene_file) {
    std::ifstream in(scene_file, std::ios::binary);
    const std::string text((std::istreambuf_iterator<char>(in)), {});
    std::uint64_t print = 0xcbf29ce484222325; // FNV-1a
    const auto add = [&print](std::string_view bytes) {
        for (const char c : bytes)
            print = (print ^ static_cast<unsigned char>(c)) * 0x100000001b3;
    };
    add(text);
    // Whatever stands in quotes may be a file.
    for (std::size_t begin = text.find('"'); begin != std::string::npos; begin = text.find('"', begin)) {
        const std::size_t end = text.find('"', begin + 1);
        if (end == std::string::npos) break;
        const std::filesystem::path file = scene_file.parent_path() / text.substr(begin + 1, end - begin - 1);
        std::error_code error;
        if (std::filesystem::is_regular_file(file, error)) {
            const auto size = std::filesystem::file_size(file, error);
            const auto written = std::filesystem::last_write_time(file, error).time_since_epoch().count();
            add(fmt::format("{} {}", size, written));
        }
        begin = end + 1;
    }
    return text.empty() ? 0 : print;
}

bool is_reloadable(const std::string& key) {
    return (key.rfind("trigger.", 0) == 0 && key != "trigger.over_trigger") || key == "daemon.log_level" ||
           key == "scene.file" || key == "deadline.policy" || key == "deadline.grace_us";
}

} // namespace obscura::emulator
