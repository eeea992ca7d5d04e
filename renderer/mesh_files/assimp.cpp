// SPDX-License-Identifier: Apache-2.0
#include "renderer/mesh_files/assimp.hpp"

#include "core/error.hpp"
#include "core/io/input_file.hpp"
#include "core/io/path_state.hpp"
#include "core/io/stop_reading.hpp"
#include "core/text/printable.hpp"
#include "core/text/text.hpp"
#include "renderer/mesh_files/assimp_files.hpp"
#include "renderer/mesh_files/smoothing_groups.hpp"

#include <assimp/Importer.hpp>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <new>
#include <stdexcept>

namespace obscura::renderer {
namespace {

constexpr std::uint64_t max_triangles = 200'000'000;
constexpr unsigned max_depth = 1000; ///< of nested nodes
/// CPU time allowed for the smallest file: twenty times what small files need.
#ifdef OBSCURA_SANITIZED
constexpr rlim_t min_cpu_s = 5;
#else
constexpr rlim_t min_cpu_s = 1;
#endif

/// Collects the triangles of an assimp scene as one mesh. Runs in the child process only.
class Collector {
public:
    Collector(const aiScene& scene, double metres_per_unit) : scene_(scene), scale_(metres_per_unit) {}

    TriangleMesh collect() {
        for (unsigned i = 0; i < scene_.mNumMeshes; ++i) {
            with_normals_ = with_normals_ || scene_.mMeshes[i]->HasNormals();
            with_uvs_ = with_uvs_ || scene_.mMeshes[i]->HasTextureCoords(0);
        }
        if (scene_.mRootNode != nullptr) node(*scene_.mRootNode, aiMatrix4x4(), 0);
        materials();
        return std::move(mesh_);
    }

private:
    void node(const aiNode& n, const aiMatrix4x4& outer, unsigned depth) {
        if (depth > max_depth) throw std::runtime_error("nodes are nested too deep");
        const aiMatrix4x4 place = outer * n.mTransformation;
        for (unsigned i = 0; i < n.mNumMeshes; ++i)
            mesh(*scene_.mMeshes[n.mMeshes[i]], place);
        for (unsigned i = 0; i < n.mNumChildren; ++i)
            node(*n.mChildren[i], place, depth + 1);
    }

    void mesh(const aiMesh& m, const aiMatrix4x4& place) {
        if (mesh_.triangles.size() + m.mNumFaces > max_triangles)
            throw std::runtime_error(fmt::format("more than {} faces", max_triangles));
        const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
        const bool mirrored = place.Determinant() < 0;
        aiMatrix3x3 turn(place);
        turn.Inverse().Transpose();
        for (unsigned i = 0; i < m.mNumVertices; ++i) {
            const aiVector3D p = place * m.mVertices[i];
            mesh_.vertices.push_back({scaled(p.x), scaled(p.y), scaled(p.z)});
            if (with_normals_) {
                // Missing ones stay zero: complete_normals() finds them.
                const aiVector3D n = m.HasNormals() ? turn * m.mNormals[i] : aiVector3D();
                const bool finite = std::isfinite(n.x) && std::isfinite(n.y) && std::isfinite(n.z);
                mesh_.normals.push_back(finite ? Vec3f{n.x, n.y, n.z} : Vec3f{});
            }
            if (with_uvs_) {
                // assimp counts v upwards from the last row, but for glTF, whose reader flips v to that.
                const bool has = m.HasTextureCoords(0);
                const aiVector3D t = has ? m.mTextureCoords[0][i] : aiVector3D();
                const bool finite = std::isfinite(t.x) && std::isfinite(t.y);
                mesh_.uvs.push_back(finite ? std::array<float, 2>{t.x, 1 - t.y} : std::array<float, 2>{});
            }
        }
        const auto slot = static_cast<std::uint16_t>(std::min(m.mMaterialIndex, 65535U));
        for (unsigned i = 0; i < m.mNumFaces; ++i) {
            const aiFace& f = m.mFaces[i];
            if (f.mNumIndices != 3) continue;
            std::array<std::uint32_t, 3> t{first + f.mIndices[0], first + f.mIndices[1],
                                           first + f.mIndices[2]};
            if (mirrored) std::swap(t[1], t[2]);
            mesh_.triangles.push_back(t);
            mesh_.material_slots.push_back(slot);
        }
    }

    [[nodiscard]] float scaled(float x) const { return static_cast<float>(static_cast<double>(x) * scale_); }

    void materials() {
        bool any = false;
        for (unsigned i = 0; i < std::min(scene_.mNumMaterials, 65536U); ++i) {
            const aiMaterial& m = *scene_.mMaterials[i];
            MeshMaterial out;
            out.name = m.GetName().C_Str();
            aiColor3D diffuse(0.6F, 0.6F, 0.6F);
            m.Get(AI_MATKEY_COLOR_DIFFUSE, diffuse);
            const float c[3] = {diffuse.r, diffuse.g, diffuse.b};
            for (std::size_t k = 0; k < 3; ++k)
                out.diffuse[k] = c[k] >= 0 && c[k] <= 1 ? c[k] : c[k] > 1 ? 1.0F : 0.0F;
            aiString path;
            if (m.GetTexture(aiTextureType_DIFFUSE, 0, &path) == aiReturn_SUCCESS)
                out.albedo_texture = path.C_Str();
            if (m.GetTexture(aiTextureType_NORMALS, 0, &path) == aiReturn_SUCCESS)
                out.normal_texture = path.C_Str();
            any = any || out.name != AI_DEFAULT_MATERIAL_NAME || !out.albedo_texture.empty();
            mesh_.materials.push_back(std::move(out));
        }
        if (!any) {
            mesh_.materials.clear();
            mesh_.material_slots.clear();
        }
    }

    const aiScene& scene_;
    double scale_;
    bool with_normals_ = false, with_uvs_ = false;
    TriangleMesh mesh_;
};

/// Files beside the mesh file that hold a part of it: materials of OBJ, numbers of glTF.
using Companions = std::vector<std::string>;

std::string file_bytes(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

TriangleMesh import(const std::filesystem::path& file, double metres_per_unit, bool normals,
                    Companions& companions) {
    Assimp::Importer importer;
    importer.SetIOHandler(new AssimpFiles(companions)); // which the importer deletes
    importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
    importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
    const std::string end = lower_case(file.extension().string());
    int removed = aiComponent_COLORS | aiComponent_TANGENTS_AND_BITANGENTS | aiComponent_BONEWEIGHTS |
                  aiComponent_ANIMATIONS | aiComponent_LIGHTS | aiComponent_CAMERAS;
    // assimp makes normals of its own for 3DS files without smoothing groups: means over all facets.
    const auto made_up = [&] { return end == ".3ds" && !has_smoothing_groups(file_bytes(file)); };
    if (!normals || end == ".stl" || made_up()) removed |= aiComponent_NORMALS;
    importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS, removed);
    const aiScene* scene = importer.ReadFile(file.string(), 0);
    if (scene == nullptr) throw std::runtime_error(importer.GetErrorString());
    // assimp rotates 3DS files, whose z is up: undo that.
    if (end == ".3ds" && scene->mRootNode != nullptr)
        scene->mRootNode->mTransformation =
            aiMatrix4x4(1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1) * scene->mRootNode->mTransformation;
    scene = importer.ApplyPostProcessing(aiProcess_ValidateDataStructure | aiProcess_RemoveComponent |
                                         aiProcess_Triangulate | aiProcess_SortByPType);
    if (scene == nullptr) throw std::runtime_error(importer.GetErrorString());
    TriangleMesh mesh = Collector(*scene, metres_per_unit).collect();
    if (end == ".stl" || end == ".ply") {
        // These formats have no materials; assimp gives a default one.
        mesh.materials.clear();
        mesh.material_slots.clear();
    }
    return mesh;
}

// Protocol from child to parent, through a file in memory: a length, then bytes, for each member.

class Writer {
public:
    explicit Writer(int fd) : fd_(fd) {}
    void bytes(const void* data, std::size_t size) {
        const char* at = static_cast<const char*>(data);
        while (size > 0) {
            const ssize_t done = write(fd_, at, std::min(size, std::size_t{1} << 30));
            if (done < 0 && errno == EINTR) continue;
            if (done <= 0) throw std::runtime_error("not enough memory");
            at += done;
            size -= static_cast<std::size_t>(done);
        }
    }
    template<typename T>
    void list(const T& values) {
        const std::uint64_t count = values.size();
        bytes(&count, sizeof count);
        bytes(values.data(), count * sizeof values[0]);
    }

private:
    int fd_;
};

class Reader {
public:
    Reader(const char* data, std::size_t size) : at_(data), left_(size) {}
    void bytes(void* to, std::size_t size) {
        if (size > left_) throw std::runtime_error("the result of its reader is truncated");
        if (size > 0) std::memcpy(to, at_, size);
        at_ += size;
        left_ -= size;
    }
    template<typename T>
    void list(T& values) {
        std::uint64_t count = 0;
        bytes(&count, sizeof count);
        if (count > left_ / sizeof values[0])
            throw std::runtime_error("the result of its reader is truncated");
        values.resize(count);
        bytes(values.data(), count * sizeof values[0]);
    }

private:
    const char* at_;
    std::size_t left_;
};

enum class Verdict : char { mesh = 'm', refused = 'r' };

void put(int fd, const TriangleMesh& mesh, const Companions& companions) {
    Writer out(fd);
    const Verdict verdict = Verdict::mesh;
    out.bytes(&verdict, sizeof verdict);
    out.list(mesh.vertices);
    out.list(mesh.normals);
    out.list(mesh.triangles);
    out.list(mesh.uvs);
    out.list(mesh.material_slots);
    const std::uint64_t count = mesh.materials.size();
    out.bytes(&count, sizeof count);
    for (const MeshMaterial& m : mesh.materials) {
        out.list(m.name);
        out.bytes(m.diffuse.data(), sizeof m.diffuse);
        out.list(m.albedo_texture.native());
        out.list(m.normal_texture.native());
    }
    for (const std::string& file : companions)
        out.list(file);
    out.list(std::string());
}

TriangleMesh get(const char* data, std::size_t size, Companions& companions) {
    Reader in(data, size);
    Verdict verdict{};
    in.bytes(&verdict, sizeof verdict);
    if (verdict == Verdict::refused) {
        std::string why;
        in.list(why);
        throw std::runtime_error(why);
    }
    TriangleMesh mesh;
    in.list(mesh.vertices);
    in.list(mesh.normals);
    in.list(mesh.triangles);
    in.list(mesh.uvs);
    in.list(mesh.material_slots);
    std::uint64_t count = 0;
    in.bytes(&count, sizeof count);
    for (std::uint64_t i = 0; i < count; ++i) {
        MeshMaterial m;
        in.list(m.name);
        in.bytes(m.diffuse.data(), sizeof m.diffuse);
        std::string path;
        in.list(path);
        m.albedo_texture = path;
        in.list(path);
        m.normal_texture = path;
        mesh.materials.push_back(std::move(m));
    }
    for (std::string companion; in.list(companion), !companion.empty();)
        companions.push_back(companion);
    // The file may have taken over the child: check its counts like those of a file.
    const auto fits = [](std::size_t n, std::size_t wanted) { return n == 0 || n == wanted; };
    if (!fits(mesh.normals.size(), mesh.vertices.size()) || !fits(mesh.uvs.size(), mesh.vertices.size()) ||
        !fits(mesh.material_slots.size(), mesh.triangles.size()))
        throw std::runtime_error("the result of its reader is inconsistent");
    for (const std::uint16_t slot : mesh.material_slots)
        if (slot >= mesh.materials.size()) throw std::runtime_error("a face refers to a missing material");
    return mesh;
}

struct Descriptor {
    int fd = -1;
    explicit Descriptor(int d) : fd(d) {}
    ~Descriptor() {
        if (fd >= 0) close(fd);
    }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
};

/// Body of the child process.
[[noreturn]] void read_in_child(int fd, pid_t parent, const std::filesystem::path& file,
                                double metres_per_unit, bool normals) {
    const auto limit = [](auto resource, rlim_t value) {
        const rlimit both{value, value};
        setrlimit(resource, &both);
    };
    // It ends with its parent; one that ended before this line is seen by its number.
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(1);
    limit(RLIMIT_CORE, 0);
    // assimp reads about 5 MB of text a second; damaged PLY files keep it busy without end.
    limit(RLIMIT_CPU, min_cpu_s + static_cast<rlim_t>(file_bytes_at(file) >> 18));
#ifndef OBSCURA_SANITIZED
    limit(RLIMIT_DATA, rlim_t{8} << 30);
#endif
    const int null = open("/dev/null", O_RDWR | O_CLOEXEC);
    dup2(null, STDOUT_FILENO);
    dup2(null, STDERR_FILENO);
    std::string why;
    try {
        Companions companions;
        const TriangleMesh mesh = import(file, metres_per_unit, normals, companions);
        put(fd, mesh, companions);
        _exit(0);
    } catch (const std::bad_alloc&) {
        why = "not enough memory";
    } catch (const std::exception& error) {
        why = error.what();
    } catch (...) {
        why = "unknown error";
    }
    if (ftruncate(fd, 0) == 0 && lseek(fd, 0, SEEK_SET) == 0) {
        Writer out(fd);
        const Verdict verdict = Verdict::refused;
        out.bytes(&verdict, sizeof verdict);
        out.list(why);
    }
    _exit(0);
}

/// Status of the child once it has ended. Throws ReadingStopped, and then it is ended.
int wait_for_child(pid_t child) {
    // poll() on a descriptor of the process wakes as soon as it ends.
    const Descriptor process(static_cast<int>(syscall(SYS_pidfd_open, child, 0)));
    int status = 0;
    try {
        for (;;) {
            const pid_t ended = waitpid(child, &status, WNOHANG);
            if (ended == child || (ended < 0 && errno != EINTR)) return status;
            check_reading();
            pollfd wanted{process.fd, POLLIN, 0};
            constexpr int between_checks_ms = 100;
            poll(&wanted, 1, process.fd < 0 ? between_checks_ms / 10 : between_checks_ms);
        }
    } catch (const ReadingStopped&) {
        kill(child, SIGKILL);
        while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
        }
        throw;
    }
}

} // namespace

TriangleMesh read_with_assimp(const std::filesystem::path& file, double metres_per_unit, bool normals) {
    require_permission(file);
    if (!is_file_at(file))
        throw InputError(fmt::format("{}: cannot open: a readable mesh file is wanted", file.string()));
    const Descriptor memory(memfd_create("mesh", MFD_CLOEXEC));
    if (memory.fd < 0)
        throw Error(exit_software, fmt::format("{}: cannot create the memory file to read it into: {}",
                                               file.string(), std::strerror(errno)));
    const pid_t parent = getpid();
    const pid_t child = fork();
    if (child < 0)
        throw Error(exit_software, fmt::format("{}: cannot start a process to read it: {}", file.string(),
                                               std::strerror(errno)));
    if (child == 0) read_in_child(memory.fd, parent, file, metres_per_unit, normals);
    const int status = wait_for_child(child);
    const auto refuse = [&](std::string_view why) {
        throw InputError(
            fmt::format("{}: not readable as a mesh: {}", file.string(), printable(trimmed(why), 300)));
    };
    if (WIFSIGNALED(status))
        refuse(WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL
                   ? std::string("it takes too much time or memory")
                   : fmt::format("assimp crashed (signal {})", WTERMSIG(status)));
    const off_t size = lseek(memory.fd, 0, SEEK_END);
    if (size <= 0) refuse("assimp returned no result");
    void* const mapped = mmap(nullptr, static_cast<std::size_t>(size), PROT_READ, MAP_PRIVATE, memory.fd, 0);
    if (mapped == MAP_FAILED) refuse("not enough memory");
    const auto unmap = [&](const void*) { munmap(mapped, static_cast<std::size_t>(size)); };
    const std::unique_ptr<const void, decltype(unmap)> hold(mapped, unmap);
    TriangleMesh mesh;
    Companions companions;
    try {
        mesh = get(static_cast<const char*>(mapped), static_cast<std::size_t>(size), companions);
    } catch (const std::runtime_error& why) {
        refuse(why.what());
    }
    validate(mesh, file.string());
    join_vertices(mesh); // which assimp does for vertices up to 1e-5 units apart
    for (const std::string& companion : companions)
        note_input(companion);
    return mesh;
}

} // namespace obscura::renderer
