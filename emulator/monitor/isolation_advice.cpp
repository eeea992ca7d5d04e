// SPDX-License-Identifier: Apache-2.0
#include "emulator/monitor/isolation_advice.hpp"

#include "emulator/monitor/own_threads.hpp"

#include <fmt/format.h>

#include <fstream>

namespace obscura::emulator {
namespace {

std::string first_line(const std::filesystem::path& file) {
    std::ifstream in(file);
    std::string line;
    std::getline(in, line);
    return line;
}

} // namespace

MachineFacts machine_facts(const CoreSet& release_cores, int highest_priority,
                           const std::filesystem::path& root) {
    MachineFacts facts;
    facts.highest_priority = highest_priority;
    facts.release_cores = release_cores;
    const std::string locked = status_field(root / "proc/self/status", "VmLck");
    facts.memory_locked = !locked.empty() && locked[0] != '0';
    const std::filesystem::path processors = root / "sys/devices/system/cpu";
    facts.isolated = parse_cores(first_line(processors / "isolated")).value_or(CoreSet{});
    facts.governor = first_line(processors / "cpu0/cpufreq/scaling_governor");
    facts.realtime_kernel = first_line(root / "sys/kernel/realtime") == "1";
    std::ifstream in(root / "proc/cpuinfo");
    for (std::string line; !facts.virtual_machine && std::getline(in, line);)
        facts.virtual_machine = line.starts_with("flags") && line.find(" hypervisor") != std::string::npos;
    return facts;
}

std::vector<std::string> isolation_advice(const MachineFacts& facts) {
    std::vector<std::string> advice;
    if (facts.highest_priority == 0)
        advice.emplace_back(
            "No thread has a SCHED_FIFO priority: rows leave late whenever another program runs. "
            "Set daemon.realtime and priorities in [threads].");
    else if (!facts.memory_locked)
        advice.emplace_back("Memory can be paged out: LimitMEMLOCK=infinity for the service.");
    if (facts.release_cores.none())
        advice.emplace_back(
            "The release thread has no core of its own: set threads.release_cores, and keep that core free with isolcpus= on the kernel's command line.");
    else if (const CoreSet shared = facts.release_cores & ~facts.isolated; shared.any())
        advice.push_back(fmt::format(
            "Core {0} of the release thread is not isolated: isolcpus=domain,managed_irq,{0} nohz_full={0} rcu_nocbs={0} on the kernel's command line.",
            cores_text(shared)));
    if (!facts.realtime_kernel)
        advice.emplace_back("The kernel is no real-time one: apt install linux-image-rt-amd64.");
    if (!facts.governor.empty() && facts.governor != "performance")
        advice.push_back(
            fmt::format("The processor changes its frequency ({}): cpupower frequency-set -g performance.",
                        facts.governor));
    if (facts.virtual_machine)
        advice.emplace_back(
            "This is a virtual machine: its host can stall it for 1 to 20 ms, whatever the settings.");
    return advice;
}

} // namespace obscura::emulator
