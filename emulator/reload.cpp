#include "emulator/reload.hpp"

#include <fmt/format.h>

#include <algorithm>
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

bool is_reloadable(const std::string& key) {
    return (key.rfind("trigger.", 0) == 0 && key != "trigger.over_trigger") || key == "daemon.log_level";
}

} // namespace obscura::emulator
