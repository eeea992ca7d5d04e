// SPDX-License-Identifier: Apache-2.0
#include "emulator/config/model_use.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <exception>
#include <string>
#include <thread>

namespace obscura::emulator {
namespace {

/// Permitted cores but those of rendering and of threads with a priority; none: there are no others, or these
/// have no cores of their own.
CoreSet cores_for_models(const ThreadsSection& threads) {
    CoreSet taken = parse_cores(threads.render_cores).value_or(CoreSet{});
    const auto take = [&taken](const std::string& cores, std::int32_t priority) {
        if (priority > 0) taken |= parse_cores(cores).value_or(CoreSet{});
    };
    take(threads.trigger_cores, threads.trigger_priority);
    take(threads.release_cores, threads.release_priority);
    take(threads.transmit_cores, threads.transmit_priority);
    take(threads.detector_cores, threads.detector_priority);
    take(threads.display_cores, threads.display_priority);
    return taken.any() ? permitted_cores() & ~taken : CoreSet{};
}

/// Runs `work` on a thread of low priority on `cores`, and waits.
void run_aside(const CoreSet& cores, const std::function<void()>& work) {
    std::exception_ptr error;
    std::thread([&] {
        enter_model_thread(cores);
        try {
            work();
        } catch (...) {
            error = std::current_exception();
        }
    }).join();
    if (error) std::rethrow_exception(error);
}

} // namespace

void enter_model_thread(const CoreSet& cores) noexcept {
    constexpr int nice_level = 10;
    name_this_thread("models");
    ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), nice_level);
    pin_this_thread(cores);
}

models::ModelUse model_use(const DaemonConfig& config) {
    models::ModelUse use;
    use.folder = models_folder(config.models);
    if (config.models.native == NativeModels::off) use.execution.target = models::NativeTarget::none;
    use.execution.max_ns = config.models.max_ns_per_evaluation;
    use.execution.aside = [cores = cores_for_models(config.threads)](const std::function<void()>& work) {
        run_aside(cores, work);
    };
    return use;
}

} // namespace obscura::emulator
