#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "proto/import/gltf/buffers.h"

namespace tessera::proto {

enum class ComponentType { int8, uint8, int16, uint16, uint32, float32 };
std::uint32_t size_of(ComponentType type);

/// What an accessor says of the values that it names. They lie within their buffer view, aligned.
struct Accessor {
  JsonCursor where;
  bool is_known = true;  ///< Otherwise its type is none of glTF's, and nothing may use it.
  ComponentType type{};
  std::uint32_t components = 1;
  bool is_matrix = false;
  bool is_normalized = false;
  bool has_bounds = false;  ///< Has both "min" and "max".
  std::uint64_t count = 0;

  std::optional<std::uint32_t> view = std::nullopt;  ///< Without one, all is zero.
  std::uint64_t offset = 0;                          ///< In the view.
  std::uint64_t stride = 0;                          ///< From element to element, also where the view gives none.

  /// Elements that replace the view's.
  struct Sparse {
    std::uint64_t count = 0;
    ComponentType index_type{};
    std::uint32_t indices = 0, values = 0;  ///< Views.
    std::uint64_t indices_offset = 0, values_offset = 0;
    JsonCursor where;
    bool is_checked = false;  ///< The indices ascend and name elements.
  };
  std::optional<Sparse> sparse = std::nullopt;

  std::uint64_t element_size() const { return std::uint64_t{size_of(type)} * components; }
};

/// The values of a glTF document.
class Accessors {
 public:
  /// Checks all accessors.
  Accessors(GltfFile& file, GltfBuffers& buffers);

  std::size_t size() const { return accessors_.size(); }
  const Accessor& operator[](std::uint32_t i) const { return accessors_[i]; }

  /// Whether the data that the accessor names is there.
  bool has_data(std::uint32_t accessor) const;

  /// The elements of a vector's accessor as floats, normalised where it says so: all of them, or those that `which`
  /// names, ascending. `Element` is made of the accessor's number of floats. Empty, with an error, when they can't be
  /// had.
  template <typename Element>
  std::vector<Element> read(std::uint32_t accessor, std::span<const std::uint32_t> which = {}) {
    constexpr std::size_t kFloats = sizeof(Element) / sizeof(float);
    std::vector<Element> out(which.empty() ? accessors_[accessor].count : which.size());
    if (!read_floats(accessor, which, kFloats, reinterpret_cast<std::byte*>(out.data()))) out.clear();
    return out;
  }

  /// Unsigned integers: indices. False, with an error, when they can't be had.
  bool read_indices(std::uint32_t accessor, std::span<std::uint32_t> out);

 private:
  struct Source {
    const char* base = nullptr;  ///< Null: zeros.
    const char* sparse_indices = nullptr;
    const char* sparse_values = nullptr;
  };

  void read_accessor(const GltfObject& object);
  void read_place(const GltfObject& object, Accessor& accessor);
  void read_sparse(const GltfObject& object, Accessor& accessor);
  std::optional<Source> source(const Accessor& accessor);
  bool check_sparse(Accessor& accessor, const char* indices);
  bool read_floats(std::uint32_t index, std::span<const std::uint32_t> which, std::size_t floats, std::byte* out);

  GltfFile& file_;
  GltfBuffers& buffers_;
  std::vector<Accessor> accessors_;
};

}  // namespace tessera::proto
