// SPDX-License-Identifier: Apache-2.0
#include "core/realtime/stack_thread.hpp"

#include <memory>
#include <system_error>
#include <utility>

namespace obscura {
namespace {

void* enter(void* argument) {
    const std::unique_ptr<std::function<void()>> run(static_cast<std::function<void()>*>(argument));
    (*run)();
    return nullptr;
}

} // namespace

StackThread::StackThread(std::size_t stack_bytes, std::function<void()> run) {
    auto argument = std::make_unique<std::function<void()>>(std::move(run));
    pthread_attr_t attributes;
    pthread_attr_init(&attributes);
    int error = pthread_attr_setstacksize(&attributes, stack_bytes);
    if (error == 0) error = pthread_create(&thread_, &attributes, enter, argument.get());
    pthread_attr_destroy(&attributes);
    if (error != 0) throw std::system_error(error, std::generic_category(), "pthread_create");
    (void)argument.release(); // the thread deletes it
}

void StackThread::join() {
    if (!joined_) pthread_join(thread_, nullptr);
    joined_ = true;
}

bool StackThread::ended() noexcept {
    if (!joined_ && pthread_tryjoin_np(thread_, nullptr) == 0) joined_ = true;
    return joined_;
}

} // namespace obscura
