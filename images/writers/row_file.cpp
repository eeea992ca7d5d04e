// SPDX-License-Identifier: Apache-2.0
#include "images/writers/row_file.hpp"

#include "core/error.hpp"
#include "core/realtime/log.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace obscura::images {
namespace {

/// Writes all of `text` at the file's end; 0, or the errno.
int append_to(int file, std::string_view text) {
    while (!text.empty()) {
        const ssize_t written = ::write(file, text.data(), text.size());
        if (written < 0 && errno != EINTR) return errno;
        if (written > 0) text.remove_prefix(static_cast<std::size_t>(written));
    }
    return 0;
}

} // namespace

RowFile::RowFile(std::filesystem::path file)
    : path_(std::move(file)),
      file_(::open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0666)) {
    if (!file_)
        throw OutputError(fmt::format("{}: cannot be written: {}", path_.string(), std::strerror(errno)),
                          errno);
}

void RowFile::add(std::string_view row) {
    waiting_ += row;
    ++waiting_rows_;
}

bool RowFile::flush() {
    if (waiting_rows_ == 0) return lost_ == 0;
    std::string text = unmarked_ > 0 ? fmt::format("# {} rows are missing here\n", unmarked_) : std::string();
    text += waiting_;
    const int error = append_to(file_.get(), text);
    if (error == 0) {
        if (unmarked_ > 0)
            log_notice("{}: written again, {} rows are missing", path_.string(), std::exchange(unmarked_, 0));
        whole_bytes_ += static_cast<std::int64_t>(text.size());
    } else {
        // A pipe keeps what went through it; a file must not end within a row.
        [[maybe_unused]] const int cut = ::ftruncate(file_.get(), whole_bytes_);
        if (unmarked_ == 0)
            log_error("{}: cannot be written: {}; rows are lost until it can", path_.string(),
                      std::strerror(error));
        unmarked_ += waiting_rows_;
        lost_ += waiting_rows_;
    }
    waiting_.clear();
    waiting_rows_ = 0;
    return lost_ == 0;
}

void RowFile::write(std::string_view row) {
    if (const int error = append_to(file_.get(), row); error != 0) {
        [[maybe_unused]] const int cut = ::ftruncate(file_.get(), whole_bytes_);
        throw OutputError(fmt::format("{}: cannot be written: {}", path_.string(), std::strerror(error)),
                          error);
    }
    whole_bytes_ += static_cast<std::int64_t>(row.size());
}

} // namespace obscura::images
