#include "proto/import/nff.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "core/math/portable.h"
#include "proto/import/broken_file.h"
#include "proto/import/import_notes.h"
#include "proto/import/mesh_repair.h"
#include "proto/import/numbers.h"
#include "proto/import/polygon.h"
#include "proto/import/text_cursor.h"

namespace tessera::proto {
namespace {

/// A display value in linear light (IEC 61966-2-1).
float decoded(float v) { return v <= 0.04045F ? v / 12.92F : portable_pow((v + 0.055F) / 1.055F, 2.4F); }
Rgb decoded(Rgb c) { return {decoded(c.r), decoded(c.g), decoded(c.b)}; }

Rgb grey(float v) { return {v, v, v}; }

bool in_reach(Vec3 p) { return is_finite(p) && max_component(abs(p)) <= kLargestCoordinate; }

/// Far beyond any use; the products and powers of what is smaller stay finite.
constexpr float kLargestShare = 1000, kLargestShine = 1e9F, kLargestLight = 1e9F;

class NffReader {
 public:
  NffReader(std::string_view text, std::string_view file_name, std::stop_token stop)
      : steps_(std::move(stop)), cursor_(text, '#'), file_name_(file_name), notes_(file_name) {}

  Imported read() {
    for (std::string_view entity = cursor_.next(); !entity.empty(); entity = take_entity()) {
      steps_.take();
      if (entity == "f" || entity == "s" || entity == "c") finish_mesh();
      read_entity(entity);
    }
    finish_mesh();
    finish_lights();
    if (result_.parts.empty()) notes_.add("The file holds no geometry");
    result_.warnings = notes_.warnings();
    return std::move(result_);
  }

 private:
  struct FileLight {
    Vec3 position;
    std::optional<Rgb> color;
  };

  void read_entity(std::string_view entity) {
    if (entity == "v") return read_view();
    if (entity == "b") return read_background();
    if (entity == "l") return read_light();
    if (entity == "f") return read_fill();
    if (entity == "c") return read_cone();
    if (entity == "s") return read_sphere();
    if (entity == "p") return read_polygon(false);
    if (entity == "pp") return read_polygon(true);
    fail("This is no NFF entity: one of v b l f c s p pp # is expected here");
  }

  [[noreturn]] void fail(std::string detail) const {
    throw BrokenFile{{{file_place(file_name_, cursor_.line()), std::move(detail)}}};
  }

  /// The entity after the current one; a view looks one token ahead.
  std::string_view take_entity() { return ahead_.empty() ? cursor_.next() : std::exchange(ahead_, {}); }

  float to_number(std::string_view token) const {
    if (token.empty()) fail("The file ends where a number is expected");
    const std::optional<float> number = parse_float(token);
    if (!number) fail("A number is expected here");
    return *number;
  }
  float number() { return to_number(cursor_.next()); }

  Vec3 vector() {
    const float x = number(), y = number(), z = number();
    return {x, y, z};
  }

  float number_up_to(float largest, const char* what) {
    const float value = number();
    if (!(value >= 0 && value <= largest)) {
      fail(std::string(what) + " must be a number from 0 to " + std::to_string(static_cast<int>(largest)));
    }
    return value;
  }
  float share(const char* what) { return number_up_to(kLargestShare, what); }

  Rgb color() { return {share("Red"), share("Green"), share("Blue")}; }

  void read_background() {
    if (result_.background) notes_.add("A further background takes the place of the one before", cursor_.line());
    result_.background = decoded(color());
  }

  void read_view() {
    const std::size_t line = cursor_.line();
    std::optional<Vec3> from, at, up;
    std::optional<float> angle;
    float columns = 512, rows = 512;
    bool has_resolution = false;
    for (std::string_view key = cursor_.next();; key = cursor_.next()) {
      if (key == "from") {
        from = vector();
      } else if (key == "at") {
        at = vector();
      } else if (key == "up") {
        up = vector();
      } else if (key == "angle") {
        angle = number();
      } else if (key == "hither") {
        number();
      } else if (key == "resolution") {
        has_resolution = true;
        columns = number();
        rows = number();
      } else {
        ahead_ = key;
        break;
      }
    }
    const auto fail_view = [&](const char* why) { throw BrokenFile{{{file_place(file_name_, line), why}}}; };
    if (!from || !at || !up || !angle) fail_view("A view needs from, at, up and angle");
    if (!in_reach(*from) || !in_reach(*at) || !is_finite(*up)) fail_view("A view's vectors must be finite");
    const std::optional<UnitVec3> forward = UnitVec3::normalize(to_double(*at) - to_double(*from));
    const std::optional<UnitVec3> upward = UnitVec3::normalize(*up);
    if (!forward || !upward) fail_view("A view's from and at must differ, and its up must not be zero");
    if (!UnitVec3::normalize(cross(to_double(*forward), to_double(*upward)))) {
      fail_view("A view's up must not be parallel to its direction");
    }
    if (!(*angle > 0 && *angle < 180)) fail_view("A view's angle must lie between 0 and 180 degrees");
    if (!(rows >= 2 && std::isfinite(rows))) fail_view("A view's resolution must be at least 2 in y");
    result_.image.reset();
    if (has_resolution) take_resolution(columns, rows, line);
    if (!result_.cameras.empty()) notes_.add("A further view takes the place of the one before", line);

    const double half = *angle * std::numbers::pi / 360, n = rows;
    const auto fov = static_cast<float>(2 * portable_atan(portable_tan(half) * n / (n - 1)));
    result_.cameras = {{"", PerspectiveCamera{{*from, *at, *up}, fov}}};
  }

  void take_resolution(float columns, float rows, std::size_t line) {
    constexpr float kMost = 1 << 24;  // Beyond it a float skips whole numbers.
    const auto is_size = [](float n) { return n >= 1 && n <= kMost && n == std::floor(n); };
    if (is_size(columns) && is_size(rows)) {
      result_.image = ImageSize{static_cast<std::uint32_t>(columns), static_cast<std::uint32_t>(rows)};
    } else {
      notes_.add("A resolution that isn't two whole numbers from 1 to 16777216 doesn't size the image", line);
    }
  }

  void read_light() {
    FileLight light{vector(), std::nullopt};
    if (!in_reach(light.position)) fail("A light's position must be finite");
    if (const std::string_view red = cursor_.next_on_line(); !red.empty()) {
      const Rgb color{to_number(red), number(), number()};
      for (const float c : {color.r, color.g, color.b}) {
        if (!(c >= 0 && c <= kLargestLight)) fail("A light's colour must be three numbers from 0 to 1e9");
      }
      light.color = color;
    }
    lights_.push_back(light);
  }

  void finish_lights() {
    if (lights_.empty()) return;
    const auto each = 1 / std::sqrt(static_cast<float>(lights_.size()));
    for (const FileLight& light : lights_) {
      const Rgb intensity = light.color.value_or(grey(each)) * std::numbers::pi_v<float>;
      result_.lights.push_back(PointLight{light.position, intensity, false});
    }
  }

  void read_fill() {
    const Rgb fill = color();
    const float kd = share("Kd"), ks = share("Ks"), shine = number_up_to(kLargestShine, "Shine"), t = share("T"),
                ior = number();
    if (t > 0 && !(ior > 0 && std::isfinite(ior))) fail("A fill that transmits needs an index of refraction above 0");
    if (!cursor_.next_on_line().empty()) {
      notes_.add("What follows a fill's eight numbers (a texture, in some dialects) is ignored", cursor_.line());
      while (!cursor_.next_on_line().empty()) continue;
    }
    WhittedSurface material;
    material.diffuse = decoded(fill * kd);
    material.specular = grey(decoded(ks));
    material.shininess = shine;
    // Haines: a surface that reflects or transmits spawns reflection rays.
    material.reflect = grey(decoded(ks > 0 || t == 0 ? ks : std::max(0.0F, 1 - t)));
    material.transmit = grey(decoded(t));
    material.ior = t > 0 ? ior : 1;
    result_.materials.push_back({material});
  }

  void add_part(Shape shape) {
    const auto fills = static_cast<std::uint32_t>(result_.materials.size());
    result_.parts.push_back({std::move(shape), fills == 0 ? std::nullopt : std::optional(fills - 1)});
  }

  void note_inside() {
    notes_.add("A negative radius (only the inside visible) counts as positive: both sides are visible",
               cursor_.line());
  }

  void read_sphere() {
    const Vec3 center = vector();
    float radius = number();
    if (radius < 0) {
      note_inside();
      radius = -radius;
    }
    if (!in_reach(center) || !(radius > 0 && radius <= kLargestCoordinate)) {
      return notes_.add("A sphere with radius 0, or that isn't finite, was dropped", cursor_.line());
    }
    add_part(Sphere{center, radius});
  }

  void read_cone() {
    const Vec3 base = vector();
    float base_radius = number();
    const Vec3 apex = vector();
    float apex_radius = number();
    if (base_radius <= 0 && apex_radius <= 0 && base_radius + apex_radius < 0) {
      note_inside();
      base_radius = -base_radius;
      apex_radius = -apex_radius;
    }
    const bool has_radii = base_radius >= 0 && apex_radius >= 0 && base_radius + apex_radius > 0 &&
                           std::max(base_radius, apex_radius) <= kLargestCoordinate;
    if (!in_reach(base) || !in_reach(apex) || base == apex || !has_radii) {
      return notes_.add(
          "A cone or cylinder without length, with radii of 0 or of both signs, or that isn't finite, "
          "was dropped",
          cursor_.line());
    }
    if (base_radius == apex_radius) {
      add_part(Cylinder{base, apex, base_radius});
    } else {
      add_part(Cone{base, base_radius, apex, apex_radius});
    }
  }

  void read_polygon(bool is_patch) {
    const std::size_t line = cursor_.line();
    const std::string_view count_token = cursor_.next();
    const std::optional<std::uint32_t> count = parse_integer<std::uint32_t>(count_token);
    if (!count) fail("A polygon starts with its number of vertices");

    if (mesh_.positions.empty()) mesh_line_ = line;
    const auto first = static_cast<std::uint32_t>(mesh_.positions.size());
    for (std::uint32_t i = 0; i < *count; ++i) {
      steps_.take();
      mesh_.positions.push_back(vector());
      mesh_.normals.push_back(is_patch ? vector() : Vec3{});
    }
    std::vector<std::uint32_t> corners(*count);
    std::iota(corners.begin(), corners.end(), first);
    if (add_polygon(corners, is_patch, line)) {
      has_patch_ |= is_patch;
    } else {
      mesh_.positions.resize(first);
      mesh_.normals.resize(first);
    }
  }

  /// False, with a note, for a polygon that can't be used.
  bool add_polygon(const std::vector<std::uint32_t>& corners, bool is_patch, std::size_t line) {
    if (corners.size() < 3) {
      notes_.add("A polygon with less than 3 vertices was dropped", line);
      return false;
    }
    const Vec3d area = area_vector(mesh_.positions, corners);
    if (area == Vec3d{}) {
      notes_.add("A polygon without area was dropped", line);
      return false;
    }
    if (!triangulate(mesh_.positions, corners, mesh_.triangles, steps_)) {
      note_lost_polygon(corners.size(), notes_, line);
      return false;
    }
    if (!is_patch) {
      const Vec3 normal = UnitVec3::normalize(area).value_or(UnitVec3::z());
      std::fill(mesh_.normals.begin() + corners.front(), mesh_.normals.end(), normal);
    }
    return true;
  }

  void finish_mesh() {
    TriangleMesh mesh = std::exchange(mesh_, {});
    if (!std::exchange(has_patch_, false)) mesh.normals.clear();
    repair_mesh(mesh, notes_, mesh_line_);
    if (!mesh.triangles.empty()) add_part(std::move(mesh));
  }

  Steps steps_;
  TextCursor cursor_;
  std::string_view ahead_;
  std::string_view file_name_;
  ImportNotes notes_;
  Imported result_;
  std::vector<FileLight> lights_;
  TriangleMesh mesh_;
  bool has_patch_ = false;
  std::size_t mesh_line_ = 0;  ///< Of the mesh's first polygon.
};

}  // namespace

Imported import_nff(std::string_view text, std::string_view file_name, std::stop_token stop) {
  return NffReader(text, file_name, std::move(stop)).read();
}

}  // namespace tessera::proto
