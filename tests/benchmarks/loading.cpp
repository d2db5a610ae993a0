// How fast OBJ and PLY files become meshes, in MB/s of one core, beside tinyobjloader and plain passes over the bytes.
//
// tests/bench loading [PART]: with PART only the files whose name contains it. tinyobjloader is measured where
// libtinyobjloader-dev is installed.
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <variant>

#include "proto/import/import.h"
#include "proto/import/read_file.h"
#include "tests/benchmarks/support/mesh_files.h"
#include "tests/benchmarks/support/report.h"
#include "tests/benchmarks/support/terrain.h"
#include "tests/support/shared_data.h"

#if __has_include(<tiny_obj_loader.h>)
#define TINYOBJLOADER_IMPLEMENTATION
#include <tiny_obj_loader.h>
#endif

namespace tessera::bench {
namespace {

namespace fs = std::filesystem;

constexpr int kRepetitions = 5;
constexpr std::uintmax_t kSmallest = 100'000;  ///< Bytes; smaller files say nothing.
constexpr std::uintmax_t kBytesARepetition = 20'000'000;
constexpr double kBar = 100;  ///< MB/s

/// Keeps results from being optimised away.
std::size_t sink = 0;

void import(const fs::path& path) {
  const std::string name = path.filename().string();
  const auto file = proto::import_file(path, *proto::format_of(name), name, [](auto) { return std::nullopt; });
  if (!file) throw std::runtime_error(name + " is refused: " + file.problem().detail);
  for (const proto::ImportedPart& part : file->parts) sink += std::get<TriangleMesh>(part.shape).triangles.size();
}

/// The least that any reader of text does: bring the bytes here and find where lines end.
void find_lines(const fs::path& path) {
  const std::string bytes = proto::read_file(path, "", UINTMAX_MAX);
  sink += static_cast<std::size_t>(std::count(bytes.begin(), bytes.end(), '\n'));
}

/// Bringing the bytes here, and once more to another place.
void copy(const fs::path& path) {
  const std::string bytes = proto::read_file(path, "", UINTMAX_MAX);
  sink += std::string(bytes).size();
}

void load_by_tinyobj([[maybe_unused]] const fs::path& path) {
#ifdef TINYOBJLOADER_IMPLEMENTATION
  tinyobj::attrib_t vertices;
  std::vector<tinyobj::shape_t> shapes;
  std::vector<tinyobj::material_t> materials;
  std::string warning, error;
  if (!tinyobj::LoadObj(&vertices, &shapes, &materials, &warning, &error, path.c_str()))
    throw std::runtime_error(error);
  sink += vertices.vertices.size();
#endif
}

class FileBench {
 public:
  explicit FileBench(fs::path path) : path_(std::move(path)), bytes_(fs::file_size(path_)) {}

  void repeat() {
    ours_.add(speed(import));
    if (is_obj() && kHasTinyobj) tinyobj_.add(speed(load_by_tinyobj));
    lines_.add(speed(find_lines));
    copy_.add(speed(copy));
  }

  static std::vector<std::string> header() {
    return {"MB/s", "MB", "ours", "tinyobjloader", "read, find lines", "read, copy"};
  }
  std::vector<std::string> row() const {
    return {name(),
            fixed(1e-6 * static_cast<double>(bytes_), 1),
            with_spread(ours_),
            with_spread(tinyobj_),
            with_spread(lines_),
            with_spread(copy_)};
  }

  void report(Report& to) const {
    to.figures()["files"][name()] = {{"bytes", bytes_},
                                     {"ours", ours_.to_json()},
                                     {"tinyobjloader", tinyobj_.to_json()},
                                     {"read_and_find_lines", lines_.to_json()},
                                     {"read_and_copy", copy_.to_json()}};
    to.at_least("load_" + std::string(is_obj() ? "obj" : "ply") + "/" + path_.stem().string(), ours_.median(), kBar);
  }

 private:
#ifdef TINYOBJLOADER_IMPLEMENTATION
  static constexpr bool kHasTinyobj = true;
#else
  static constexpr bool kHasTinyobj = false;
#endif

  std::string name() const { return path_.filename().string(); }
  bool is_obj() const { return path_.extension() == ".obj"; }

  /// MB a second of processor time; small files are loaded again and again.
  double speed(void (*load)(const fs::path&)) const {
    const std::uintmax_t times = std::max<std::uintmax_t>(1, kBytesARepetition / bytes_);
    const CpuStopwatch watch;
    for (std::uintmax_t i = 0; i < times; ++i) load(path_);
    return 1e-6 * static_cast<double>(bytes_ * times) / watch.seconds();
  }

  fs::path path_;
  std::uintmax_t bytes_;
  Samples ours_, tinyobj_, lines_, copy_;
};

/// Hills of 100 to 200 MB as text in every form, in a folder that goes with this.
class GeneratedFiles {
 public:
  GeneratedFiles() : folder_(fs::temp_directory_path() / "tessera-bench-loading") {
    fs::create_directories(folder_);
    TriangleMesh mesh = terrain(2'400'000);
    write_obj(mesh, ObjCorners::v, folder_ / "hills_v.obj");
    write_ply(mesh, PlyBody::ascii, folder_ / "hills_ascii.ply");
    write_ply(mesh, PlyBody::little_endian, folder_ / "hills_binary.ply");
    mesh.normals = mesh.positions;  // of any direction: nothing looks at it
    write_obj(mesh, ObjCorners::v_vn, folder_ / "hills_v_vn.obj");
    write_obj(mesh, ObjCorners::v_vt_vn, folder_ / "hills_v_vt_vn.obj");
  }
  ~GeneratedFiles() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  GeneratedFiles(const GeneratedFiles&) = delete;

  const fs::path& folder() const { return folder_; }

 private:
  fs::path folder_;
};

void add_files(std::vector<FileBench>& benches, const fs::path& folder, const std::string& name_part) {
  std::vector<fs::path> paths;
  for (const auto& entry : fs::directory_iterator(folder)) paths.push_back(entry.path());
  std::ranges::sort(paths);
  for (const fs::path& path : paths) {
    const std::string name = path.filename().string();
    if (name.find(name_part) == std::string::npos || fs::file_size(path) < kSmallest) continue;
    if (proto::format_of(name)) benches.emplace_back(path);
  }
}

void measure(Report& report, const std::string& name_part) {
  const GeneratedFiles generated;
  std::vector<FileBench> benches;
  add_files(benches, generated.folder(), name_part);
  if (const auto data = shared_data())
    add_files(benches, *data / "meshes", name_part);
  else
    std::printf("skipped: the meshes of shared/data (none beside this checkout)\n");

  // Interleaved: whatever else the machine does meets every file alike.
  for (int i = 0; i < kRepetitions; ++i)
    for (FileBench& bench : benches) bench.repeat();
  std::printf(
      "\nFrom a path to checked meshes, the file's bytes in the system's cache. MB (10^6 bytes) a second of processor\n"
      "time on one core. Medians of %d interleaved repetitions, ± half the distance between the quartiles.\n",
      kRepetitions);
  std::vector<std::vector<std::string>> rows = {FileBench::header()};
  for (const FileBench& bench : benches) {
    rows.push_back(bench.row());
    bench.report(report);
  }
  print_table(rows);
  report.figures()["sink"] = sink;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  if (argc != 2 && argc != 3) {
    std::fprintf(stderr, "usage: bench_loading FOLDER [PART_OF_A_FILE'S_NAME]\n");
    return 2;
  }
  try {
    tessera::bench::Report report("loading", argv[1]);
    tessera::bench::measure(report, argc == 3 ? argv[2] : "");
    report.finish();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_loading: %s\n", error.what());
    return 1;
  }
}
