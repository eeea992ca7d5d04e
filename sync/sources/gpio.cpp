// SPDX-License-Identifier: Apache-2.0
#include "sync/sources/gpio.hpp"

#include "sync/edge_trigger.hpp"
#include "sync/inputs/gpio_line_name.hpp"
#include "sync/settings.hpp"

#include <stdexcept>

namespace obscura::sync {

config::Keys GpioKind::keys() {
    return {
        config::key("line", &line).help("gpio: name of the GPIO line, or \"gpiochipN:OFFSET\""),
        config::key("edge", &edge).help("gpio: edges that are reported"),
    };
}

void GpioKind::check(const TriggerLineSettings& /*camera_line*/, const Refuse& refuse) const {
    try {
        (void)parse_gpio_line(line);
    } catch (const std::invalid_argument& error) {
        refuse("line", error.what());
    }
}

LineEdges GpioKind::edges() const {
    return {.rising = edge != GpioEdge::falling, .falling = edge != GpioEdge::rising};
}

std::unique_ptr<TriggerSource> GpioKind::make(const TriggerLineSettings& camera_line, const Clock& clock,
                                              const ThreadSettings& thread) const {
    GpioSettings gpio;
    gpio.table = camera_line.table();
    gpio.line = line;
    gpio.edge = edge;
    gpio.debounce_ns = camera_line.debounce_ns();
    return std::make_unique<EdgeTrigger>(
        edge_trigger_settings(camera_line, thread), [gpio] { return open_gpio(gpio); }, clock);
}

} // namespace obscura::sync
