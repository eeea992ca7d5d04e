// SPDX-License-Identifier: Apache-2.0
// File access of assimp: text files made plain, the files opened noted.
#pragma once

#include <assimp/DefaultIOSystem.h>

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace obscura::renderer {

/// Assimp's view of the file system. Text files (OBJ, MTL, glTF, Collada, PLY and STL of text) are read as
/// make_plain_text() makes them; OBJ and MTL without lines that a backslash continues, STL in small letters.
/// Other files are opened as they are; what is no regular file is not there. Thread-bound.
class AssimpFiles final : public Assimp::DefaultIOSystem {
public:
    /// `opened` gets the names of the files opened; it outlives this.
    explicit AssimpFiles(std::vector<std::string>& opened) : opened_(opened) {}

    Assimp::IOStream* Open(const char* file, const char* mode) override;

private:
    std::vector<std::string>& opened_;
    /// Text of the files that differ from what is on the disk, by name; no value: as on the disk.
    std::map<std::string, std::optional<std::string>> texts_;
};

} // namespace obscura::renderer
