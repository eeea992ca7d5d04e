// SPDX-License-Identifier: Apache-2.0
#include "serve/compatible/client_files.hpp"

#include "config/document.hpp"
#include "core/io/file_descriptor.hpp"
#include "core/io/path_state.hpp"
#include "core/text/printable.hpp"
#include "service/failure.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/evp.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <fstream>
#include <system_error>

namespace obscura::serve {
namespace {

using service::Failure;
using service::FailureCode;

/// Folders of the resource path in which names are looked up too.
constexpr std::array<std::string_view, 7> typed_folders{"materials", "DEM",    "textures", "sensors",
                                                        "models",    "meshes", "stars"};

Failure missing(const std::string& name) {
    return service::bad_argument(
        "filename",
        fmt::format(
            "\"{}\": there is no such file below the server's folder, its folders materials, DEM, textures and sensors, and the output folder",
            printable(name)));
}

std::string md5_of(const std::filesystem::path& file) {
    EVP_MD_CTX* context = EVP_MD_CTX_new();
    EVP_DigestInit_ex(context, EVP_md5(), nullptr);
    std::ifstream in(file, std::ios::binary);
    std::vector<char> piece(1 << 20);
    while (in.read(piece.data(), static_cast<std::streamsize>(piece.size())) || in.gcount() > 0)
        EVP_DigestUpdate(context, piece.data(), static_cast<std::size_t>(in.gcount()));
    std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
    unsigned int bytes = 0;
    EVP_DigestFinal_ex(context, digest.data(), &bytes);
    EVP_MD_CTX_free(context);
    std::string hex;
    for (unsigned int i = 0; i < bytes; ++i)
        hex += fmt::format("{:02x}", digest[i]);
    return hex;
}

void write_all(int file, std::string_view data, std::uint64_t offset, const std::string& name) {
    while (!data.empty()) {
        const ssize_t written = ::pwrite(file, data.data(), data.size(), static_cast<off_t>(offset));
        if (written < 0 && errno == EINTR) continue;
        if (written <= 0)
            throw Failure(FailureCode::internal,
                          fmt::format("\"{}\": {}", printable(name), std::generic_category().message(errno)));
        data.remove_prefix(static_cast<std::size_t>(written));
        offset += static_cast<std::uint64_t>(written);
    }
}

} // namespace

ClientFiles::ClientFiles(std::filesystem::path root, const std::filesystem::path& output,
                         std::uint64_t max_bytes, compatible::ResourceTable resources)
    : root_(std::move(root)), resources_(std::move(resources)), left_bytes_(max_bytes) {
    if (!output.empty()) output_.emplace(output);
}

std::optional<std::string> ClientFiles::relative(const std::string& name, const FolderBelow& folder) {
    if (!name.starts_with('/')) return name;
    const std::string top = folder.path().string() + "/";
    if (name.starts_with(top)) return name.substr(top.size());
    return {};
}

std::optional<std::filesystem::path> ClientFiles::find(const std::string& name) const {
    std::vector<std::string> below_root;
    if (const auto inside = relative(name, root_)) {
        if (name.starts_with('/')) {
            below_root = {*inside};
        } else {
            const std::string path = resource_path_.empty() ? "" : resource_path_ + "/";
            below_root = {folder_.empty() ? name : folder_ + "/" + name, path + name};
            for (const std::string_view typed : typed_folders)
                below_root.push_back(fmt::format("{}{}/{}", path, typed, name));
            below_root.push_back(name);
        }
    }
    const auto below_output = output_ ? relative(name, *output_) : std::nullopt;
    if (below_root.empty() && !below_output) {
        if (auto found = resources_.find(name)) return found;
        throw Failure(
            FailureCode::forbidden,
            fmt::format("\"{}\": only files below the server's folder can be used", printable(name)));
    }
    for (const std::string& place : below_root)
        if (auto found = root_.find(place); found && is_file_at(*found)) return found;
    if (below_output)
        if (auto found = output_->find(*below_output); found && is_file_at(*found)) return found;
    return resources_.find(name);
}

std::filesystem::path ClientFiles::existing(const std::string& name) const {
    if (auto found = find(name)) return *found;
    throw missing(name);
}

const FolderBelow& ClientFiles::output() const {
    if (output_) return *output_;
    throw Failure(FailureCode::forbidden,
                  "the server was started without an output folder: nothing can be written");
}

std::filesystem::path ClientFiles::place_for(const std::string& name) const {
    if (const auto inside = relative(name, output())) return output().place_for(*inside, false);
    throw Failure(FailureCode::forbidden,
                  fmt::format("\"{}\": only files below the output folder can be written", printable(name)));
}

std::string ClientFiles::without_folders(std::string text) const {
    const auto erase = [&text](const FolderBelow& folder) {
        const std::string top = folder.path().string() + "/";
        for (std::size_t at = text.find(top); at != std::string::npos; at = text.find(top))
            text.erase(at, top.size());
    };
    erase(root_);
    if (output_) erase(*output_);
    return text;
}

void ClientFiles::change_folder(const std::string& name) {
    std::string wanted = name.starts_with('/') ? name.substr(1)
                         : folder_.empty()     ? name
                                               : folder_ + "/" + name;
    if (const auto inside = relative(name, root_); inside && name.starts_with('/')) wanted = *inside;
    const auto found = root_.find(wanted);
    if (!found || !is_folder_at(*found))
        throw service::bad_argument(
            "path", fmt::format("\"{}\": there is no such folder below the server's", printable(name)));
    const std::filesystem::path inside = found->lexically_relative(root_.path());
    folder_ = inside == "." ? "" : inside.string();
}

std::string ClientFiles::listing() const {
    std::string text;
    for (const std::string& name : root_.list(folder_))
        text += name + "\n";
    return text;
}

void ClientFiles::set_resource_path(const std::string& name) {
    const auto inside = relative(name, root_);
    const auto found = inside                          ? root_.find(*inside)
                       : name == root_.path().string() ? root_.find("")
                                                       : std::nullopt;
    if (!found || !is_folder_at(*found))
        throw service::bad_argument(
            "ressource_path",
            fmt::format("\"{}\": there is no such folder below the server's", printable(name)));
    const std::filesystem::path below = found->lexically_relative(root_.path());
    resource_path_ = below == "." ? "" : below.string();
}

std::string ClientFiles::sent_name(const std::string& name) const {
    const std::string top = synchronised_ + "/";
    if (!synchronised_.empty() && name.starts_with(top)) return name.substr(top.size());
    if (const auto inside = relative(name, output())) return *inside;
    throw Failure(FailureCode::forbidden,
                  fmt::format("\"{}\": only files below the output folder can be written", printable(name)));
}

void ClientFiles::receive(const std::string& name, std::string_view data, std::uint64_t offset, bool append) {
    if (data.size() > left_bytes_ || offset > left_bytes_ - data.size())
        throw Failure(FailureCode::too_large, "more bytes in files than a client may send");
    const std::filesystem::path place = output().place_for(sent_name(name), true);
    // The last part is a file or nothing, and no other than the server makes links below the output folder.
    const FileDescriptor file(
        ::open(place.c_str(), O_WRONLY | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666)); // NOLINT
    if (!file || (!append && ::ftruncate(file.get(), static_cast<off_t>(offset)) != 0))
        throw Failure(FailureCode::internal,
                      fmt::format("\"{}\": {}", printable(name), std::generic_category().message(errno)));
    write_all(file.get(), data, offset, name);
    left_bytes_ -= data.size();
}

bool ClientFiles::has(const std::string& name, const std::string& md5) {
    constexpr std::string_view md5_of_nothing = "d41d8cd98f00b204e9800998ecf8427e";
    if (md5 == md5_of_nothing) {
        receive(name, {}, 0, false);
        return true;
    }
    const auto found = output().find(sent_name(name));
    return found && is_file_at(*found) && md5_of(*found) == md5;
}

} // namespace obscura::serve
