#include "config/sensor_file.hpp"

#include "config/config.hpp"
#include "config/tables.hpp"

#include <fmt/format.h>

namespace obscura::config {
namespace {

/// A sensor whose figures contradict each other; `where` and `at` name the table they came from.
void check_sensor(const SensorDescription& sensor, const Where& where, Position at) {
    const ReadoutSettings& r = sensor.readout;
    if (!(r.sample_instant_ns < r.reset_instant_ns && r.reset_instant_ns < r.row_overhead_ns))
        fail(where.in("readout"), at,
             fmt::format("sample_instant_ns {} < reset_instant_ns {} < row_overhead_ns {} does not hold",
                         r.sample_instant_ns, r.reset_instant_ns, r.row_overhead_ns));
    const DetectorSettings& d = sensor.detector;
    if (d.offset_dn >= static_cast<double>(1 << d.adc_bits))
        fail(where.in("detector"), at,
             fmt::format("offset_dn {} is above the full scale of {} bits", d.offset_dn, d.adc_bits));
}

} // namespace

void read_sensor(const Value& table, const Where& where, SensorDescription& sensor, bool may_refer) {
    if (const Member* file = table.find("file"); may_refer && file != nullptr) {
        std::string path;
        Value only_file;
        only_file.members.push_back(*file);
        read_keys(only_file, where, {{"file", Path{&path}}});
        read_sensor(parse_file(path), {path, ""}, sensor, false);
    }
    std::vector<std::string_view> tables{"readout", "detector"};
    if (may_refer) tables.push_back("file");
    read_keys(table, where, keys_of(sensor), tables, true);
    const auto read_part = [&](std::string_view name, const Keys& keys) {
        if (const Member* member = table.find(name))
            read_keys(expect_table(member->value, where.in(name)), where.in(name), keys, {}, true);
    };
    read_part("readout", keys_of(sensor.readout));
    read_part("detector", keys_of(sensor.detector));
    const Member* readout = table.find("readout");
    check_sensor(sensor, where, readout != nullptr ? readout->at : table.at);
}

SensorDescription load_sensor(const std::filesystem::path& file) {
    SensorDescription sensor;
    sensor.name = file.stem().string();
    const Value root = parse_file(file);
    if (root.members.empty()) fail({file, ""}, root.at, "an empty sensor file; at least its name is needed");
    read_sensor(root, {file, ""}, sensor, false);
    return sensor;
}

} // namespace obscura::config
