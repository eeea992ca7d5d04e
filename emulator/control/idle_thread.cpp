// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/idle_thread.hpp"

#include "service/failure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>
#include <utility>

namespace obscura::emulator {
namespace {

using service::Failure;
using service::FailureCode;

constexpr std::chrono::milliseconds idle_poll_interval{20};

} // namespace

IdleThread::IdleThread(std::function<void()> enter, std::function<void()> drop,
                       std::chrono::milliseconds unused)
    : enter_(std::move(enter)), drop_(std::move(drop)), unused_(unused) {}

IdleThread::~IdleThread() {
    close();
    if (thread_.joinable()) thread_.join();
}

void IdleThread::close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    waiting_.clear();
    if (current_) current_->cancel = true;
    asked_.notify_all();
    done_.notify_all();
}

bool IdleThread::running() const {
    const std::lock_guard lock(mutex_);
    return running_;
}

void IdleThread::run(Work work, const std::atomic<bool>& given_up) {
    const auto job = std::make_shared<Job>();
    job->work = std::move(work);
    std::unique_lock lock(mutex_);
    if (!closed_ && waiting_.size() >= max_waiting)
        throw Failure(FailureCode::busy, "too many requests wait for this");
    if (!closed_) {
        start();
        waiting_.push_back(job);
        asked_.notify_one();
    }
    while (!job->done && !given_up && !closed_)
        done_.wait_for(lock, idle_poll_interval);
    if (!job->done) {
        job->cancel = true;
        waiting_.erase(std::remove(waiting_.begin(), waiting_.end(), job), waiting_.end());
        if (closed_) throw Failure(FailureCode::not_now, "the daemon is stopping");
        throw Failure(FailureCode::cancelled, "cancelled");
    }
    lock.unlock();
    if (job->error) std::rethrow_exception(job->error);
}

/// With the mutex.
void IdleThread::start() {
    if (running_) return;
    // One that has left loop() takes the lock no more.
    if (thread_.joinable()) thread_.join();
    try {
        thread_ = std::thread([this] { loop(); });
    } catch (const std::system_error& error) { // such as too little memory that may be locked
        throw Failure(FailureCode::busy, fmt::format("no thread for this: {}", error.what()));
    }
    running_ = true;
}

void IdleThread::loop() {
    enter_();
    std::unique_lock lock(mutex_);
    while (true) {
        if (!asked_.wait_for(lock, unused_, [this] { return closed_ || !waiting_.empty(); }) || closed_) {
            lock.unlock();
            drop_();
            lock.lock();
            if (closed_ || waiting_.empty()) break;
            continue;
        }
        current_ = waiting_.front();
        waiting_.pop_front();
        lock.unlock();
        std::exception_ptr error;
        try {
            current_->work(current_->cancel);
        } catch (...) {
            error = std::current_exception();
        }
        lock.lock();
        current_->error = error;
        current_->done = true;
        current_.reset();
        done_.notify_all();
    }
    running_ = false;
}

} // namespace obscura::emulator
