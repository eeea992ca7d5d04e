// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/kernels/kernel_files.hpp"

#include "core/error.hpp"
#include "core/io/input_file.hpp"

#include <fmt/format.h>

#include <string>
#include <string_view>

namespace obscura::ephemeris {
namespace {

/// Deepest nesting of meta-kernels, and most files: more means that they name each other.
constexpr int deepest = 8;
constexpr std::size_t max_files = 10'000;

/// Replaces "$NAME" by the values of PATH_SYMBOLS and PATH_VALUES, the longest symbol first.
std::string with_symbols(const std::string& file, const KernelPool& meta) {
    const KernelPool::Variable* const symbols = meta.find("PATH_SYMBOLS");
    const KernelPool::Variable* const values = meta.find("PATH_VALUES");
    const std::size_t count = symbols == nullptr ? 0 : symbols->strings.size();
    if (count != (values == nullptr ? 0 : values->strings.size()))
        throw InputError(fmt::format("{}: PATH_SYMBOLS and PATH_VALUES differ in length",
                                     (symbols != nullptr ? symbols : values)->place));
    std::string path;
    for (std::size_t i = 0; i < file.size();) {
        std::size_t best = count;
        if (file[i] == '$')
            for (std::size_t k = 0; k < count; ++k)
                if (std::string_view(file).substr(i + 1).starts_with(symbols->strings[k]) &&
                    (best == count || symbols->strings[k].size() > symbols->strings[best].size()))
                    best = k;
        if (best == count) {
            path += file[i++];
        } else {
            path += values->strings[best];
            i += 1 + symbols->strings[best].size();
        }
    }
    return path;
}

class Reader {
public:
    explicit Reader(KernelFiles& kernels) : kernels_(kernels) {}

    void read(const std::filesystem::path& file, int depth) {
        require_regular_file(file);
        if (++read_ > max_files)
            throw InputError(fmt::format("{}: more than {} kernels", file.string(), max_files));
        if (Daf::starts_as_daf(file)) {
            kernels_.dafs.emplace_back(file);
            return;
        }
        KernelPool own;
        own.read(file);
        if (const KernelPool::Variable* const names = own.find("KERNELS_TO_LOAD")) {
            if (depth >= deepest)
                throw InputError(fmt::format("{}: meta-kernels name each other", names->place));
            read_named(file, own, *names, depth);
        }
        kernels_.pool.read(file);
    }

private:
    void read_named(const std::filesystem::path& meta_file, const KernelPool& meta,
                    const KernelPool::Variable& names, int depth) {
        std::string name;
        for (const std::string& part : names.strings) {
            // A name that ends with '+' goes on in the next string.
            if (part.ends_with('+')) {
                name += part.substr(0, part.size() - 1);
                continue;
            }
            name += part;
            const std::filesystem::path path = meta_file.parent_path() / with_symbols(name, meta);
            name.clear();
            try {
                read(path, depth + 1);
            } catch (const InputError& error) {
                throw InputError(fmt::format("{} (of {})", error.what(), meta_file.string()));
            }
        }
    }

    KernelFiles& kernels_;
    std::size_t read_ = 0;
};

} // namespace

KernelFiles read_kernels(const std::vector<std::filesystem::path>& files) {
    KernelFiles kernels;
    Reader reader(kernels);
    for (const std::filesystem::path& file : files)
        reader.read(file, 0);
    return kernels;
}

} // namespace obscura::ephemeris
