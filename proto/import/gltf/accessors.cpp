#include "proto/import/gltf/accessors.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <ranges>
#include <string>
#include <type_traits>

namespace tessera::proto {
namespace {

constexpr std::uint64_t kLargestOffset = 1ULL << 53;

std::optional<ComponentType> component_type(std::uint32_t number) {
  switch (number) {
    case 5120:
      return ComponentType::int8;
    case 5121:
      return ComponentType::uint8;
    case 5122:
      return ComponentType::int16;
    case 5123:
      return ComponentType::uint16;
    case 5125:
      return ComponentType::uint32;
    case 5126:
      return ComponentType::float32;
    default:
      return std::nullopt;
  }
}

struct TypeName {
  std::string_view name;
  std::uint32_t components;
  bool is_matrix;
};
constexpr TypeName kTypes[] = {{"SCALAR", 1, false}, {"VEC2", 2, false}, {"VEC3", 3, false}, {"VEC4", 4, false},
                               {"MAT2", 4, true},    {"MAT3", 9, true},  {"MAT4", 16, true}};

/// From the first byte of an element to its last. A matrix' columns begin at multiples of 4 bytes.
std::uint64_t extent(const Accessor& a) {
  const std::uint64_t size = a.element_size();
  if (!a.is_matrix) return size;
  const std::uint64_t columns = a.components == 4 ? 2 : a.components == 9 ? 3 : 4, column = size / columns;
  return (columns - 1) * ((column + 3) / 4 * 4) + column;
}

template <typename T>
T load(const char* at) {
  T value;
  std::memcpy(&value, at, sizeof(T));
  return value;
}

template <typename T, bool is_normalized>
float as_float(T value) {
  if constexpr (!is_normalized) return static_cast<float>(value);
  const float fraction = static_cast<float>(value) / static_cast<float>(std::numeric_limits<T>::max());
  return std::is_signed_v<T> ? std::max(fraction, -1.0F) : fraction;
}

/// Elements of `floats` components: `stride` bytes from one to the next.
using Convert = void (*)(const char* element, std::size_t floats, std::byte* out);

template <typename T, bool is_normalized>
void convert(const char* element, std::size_t floats, std::byte* out) {
  for (std::size_t i = 0; i < floats; ++i) {
    const float value = as_float<T, is_normalized>(load<T>(element + i * sizeof(T)));
    std::memcpy(out + i * sizeof(float), &value, sizeof(float));
  }
}

/// `count` elements, `stride` bytes apart.
template <typename T, bool is_normalized>
void convert_run(const char* first, std::size_t stride, std::size_t count, std::size_t floats, std::byte* out) {
  for (std::size_t i = 0; i < count; ++i)
    convert<T, is_normalized>(first + i * stride, floats, out + i * floats * sizeof(float));
}

/// Calls `use` with the type of the components, and whether they are normalised, as types.
template <typename Use>
void with_type(ComponentType type, bool is_normalized, const Use& use) {
  const auto of = [&]<typename T>(T) { is_normalized ? use(T{}, std::true_type{}) : use(T{}, std::false_type{}); };
  switch (type) {
    case ComponentType::int8:
      return of(std::int8_t{});
    case ComponentType::uint8:
      return of(std::uint8_t{});
    case ComponentType::int16:
      return of(std::int16_t{});
    case ComponentType::uint16:
      return of(std::uint16_t{});
    case ComponentType::uint32:
      return use(std::uint32_t{}, std::false_type{});
    case ComponentType::float32:
      return use(float{}, std::false_type{});
  }
}

std::uint32_t index_at(const char* indices, ComponentType type, std::size_t i) {
  switch (type) {
    case ComponentType::uint8:
      return load<std::uint8_t>(indices + i);
    case ComponentType::uint16:
      return load<std::uint16_t>(indices + 2 * i);
    default:
      return load<std::uint32_t>(indices + 4 * i);
  }
}

bool is_unsigned(ComponentType type) {
  return type == ComponentType::uint8 || type == ComponentType::uint16 || type == ComponentType::uint32;
}

}  // namespace

std::uint32_t size_of(ComponentType type) {
  switch (type) {
    case ComponentType::int8:
    case ComponentType::uint8:
      return 1;
    case ComponentType::int16:
    case ComponentType::uint16:
      return 2;
    default:
      return 4;
  }
}

Accessors::Accessors(GltfFile& file, GltfBuffers& buffers) : file_(file), buffers_(buffers) {
  const auto objects = file.root().array("accessors");
  accessors_.reserve(objects.size());
  for (const JsonCursor& object : objects) read_accessor(GltfObject(object));
}

void Accessors::read_accessor(const GltfObject& object) {
  Accessor& a = accessors_.emplace_back(Accessor{.where = object.value()});
  std::uint32_t number = 0;
  const auto component = object.required("componentType"), type = object.required("type"),
             count = object.required("count"), normalized = object.find("normalized");
  if (!component || !type || !count || !proto::read(component, number, 0, UINT32_MAX) ||
      !proto::read(count, a.count, 1, UINT32_MAX) || !proto::read(normalized, a.is_normalized)) {
    a.is_known = false;
    return;
  }
  const auto known = component_type(number);
  const auto name = type->kind() == JsonKind::string ? std::ranges::find(kTypes, type->string(), &TypeName::name)
                                                     : (type->expected("a string"), std::ranges::end(kTypes));
  if (!known || name == std::ranges::end(kTypes)) {
    a.is_known = false;
    file_.note(object.value(), "An accessor of a type that glTF doesn't know is ignored");
    return;
  }
  a.type = *known;
  a.components = name->components;
  a.is_matrix = name->is_matrix;
  a.has_bounds = object.find("min") && object.find("max");
  if (a.is_normalized && (a.type == ComponentType::float32 || a.type == ComponentType::uint32)) {
    normalized->error("Only integers of 8 and 16 bits can be normalised.");
    a.is_normalized = false;
  }
  read_place(object, a);
  read_sparse(object, a);
}

void Accessors::read_place(const GltfObject& object, Accessor& a) {
  const auto view_field = object.find("bufferView"), offset = object.find("byteOffset");
  a.stride = extent(a);
  if (!proto::read(offset, a.offset, 0, kLargestOffset)) a.is_known = false;
  if (!view_field) {
    if (offset) offset->error("An accessor without a buffer view has no offset.");
    return;
  }
  a.view = read_reference(view_field, buffers_.views(), "buffer view");
  if (!a.view || !a.is_known) {
    a.is_known = false;
    return;
  }
  const BufferView& view = buffers_.view(*a.view);
  const std::uint32_t component = size_of(a.type);
  if (a.offset % component != 0) {
    offset->error("The offset is no multiple of a component's " + std::to_string(component) + " bytes.");
  } else if ((view.offset + a.offset) % component != 0) {
    a.where.error("The data begins at byte " + std::to_string(view.offset + a.offset) +
                  " of its buffer, which is no multiple of a component's " + std::to_string(component) + " bytes.");
  }
  if (a.is_matrix && a.offset % 4 != 0) offset->error("A matrix begins at a multiple of 4 bytes.");
  if (view.stride && *view.stride < a.stride) {
    a.where.error("The view's stride of " + std::to_string(*view.stride) + " bytes is shorter than an element, " +
                  std::to_string(a.stride) + ".");
  }
  if (view.stride) a.stride = std::max<std::uint64_t>(*view.stride, a.stride);
  if (!view.stride && a.is_matrix) a.stride = (a.stride + 3) / 4 * 4;
  const std::uint64_t end = a.offset + a.stride * (a.count - 1) + extent(a);
  if (end > view.length) {
    a.where.error("The elements end at byte " + std::to_string(end) + " of a buffer view that has " +
                  std::to_string(view.length) + ".");
    a.is_known = false;
  }
}

void Accessors::read_sparse(const GltfObject& object, Accessor& a) {
  const auto sparse = object.object("sparse");
  if (!sparse) return;
  Accessor::Sparse s{.where = sparse->value()};
  const auto count = sparse->required("count");
  if (!count || !proto::read(count, s.count, 1, UINT32_MAX)) return;
  if (s.count > a.count) {
    count->error("More elements are replaced than the accessor's " + std::to_string(a.count) + ".");
    return;
  }
  bool good = true;
  const auto place = [&](std::string_view name, std::uint32_t& view, std::uint64_t& offset, std::uint64_t size,
                         std::uint64_t alignment) {
    const auto part = sparse->object(name);
    const auto field = part ? part->required("bufferView") : sparse->required(name);
    const auto found = part ? read_reference(field, buffers_.views(), "buffer view") : std::nullopt;
    if (!found || !proto::read(part->find("byteOffset"), offset, 0, kLargestOffset)) {
      good = false;
      return;
    }
    view = *found;
    good &= buffers_.use(view, ViewUse::other, *field);
    if ((buffers_.view(view).offset + offset) % alignment != 0)
      good = part->value().error("The data isn't aligned to its components' " + std::to_string(alignment) + " bytes.");
    if (offset + size * s.count > buffers_.view(view).length)
      good = part->value().error("The elements lie beyond their buffer view.");
  };
  if (const auto indices = sparse->object("indices")) {
    std::uint32_t number = 0;
    const auto type = indices->required("componentType");
    const auto known = type && proto::read(type, number, 0, UINT32_MAX) ? component_type(number) : std::nullopt;
    if (type && (!known || !is_unsigned(*known))) type->expected("the number of an unsigned integer type");
    if (!known || !is_unsigned(*known)) return;
    s.index_type = *known;
  }
  place("indices", s.indices, s.indices_offset, size_of(s.index_type), size_of(s.index_type));
  place("values", s.values, s.values_offset, a.element_size(), size_of(a.type));
  if (good) a.sparse = s;
}

bool Accessors::has_data(std::uint32_t index) const {
  const Accessor& a = accessors_[index];
  return (!a.view || buffers_.has_bytes(*a.view)) &&
         (!a.sparse || (buffers_.has_bytes(a.sparse->indices) && buffers_.has_bytes(a.sparse->values)));
}

std::optional<Accessors::Source> Accessors::source(const Accessor& a) {
  Source source;
  if (!a.is_known) {
    a.where.error("This accessor is used, and can't be read.");
    return std::nullopt;
  }
  const auto find = [&](std::uint32_t view, std::uint64_t offset, const char*& out) {
    const auto bytes = buffers_.bytes(view, a.where);
    if (bytes) out = bytes->data() + offset;
    return bytes.has_value();
  };
  if (a.view && !find(*a.view, a.offset, source.base)) return std::nullopt;
  if (a.sparse && !(find(a.sparse->indices, a.sparse->indices_offset, source.sparse_indices) &&
                    find(a.sparse->values, a.sparse->values_offset, source.sparse_values)))
    return std::nullopt;
  return source;
}

/// Whether the indices of replaced elements ascend and name some.
bool Accessors::check_sparse(Accessor& a, const char* indices) {
  Accessor::Sparse& sparse = *a.sparse;
  std::uint64_t least = 0;
  for (std::uint64_t i = 0; i < sparse.count && !sparse.is_checked; ++i) {
    file_.steps().take();
    const std::uint32_t at = index_at(indices, sparse.index_type, i);
    if (at < least || at >= a.count)
      return sparse.where.error("Index " + std::to_string(i) + " is " + std::to_string(at) +
                                "; the indices must ascend and stay below " + std::to_string(a.count) + ".");
    least = std::uint64_t{at} + 1;
  }
  return sparse.is_checked = true;
}

bool Accessors::read_floats(std::uint32_t index, std::span<const std::uint32_t> which, std::size_t floats,
                            std::byte* out) {
  Accessor& a = accessors_[index];
  const auto from = source(a);
  if (!from || (a.sparse && !check_sparse(a, from->sparse_indices))) return false;
  const std::size_t element = floats * sizeof(float);
  const std::size_t count = which.empty() ? a.count : which.size();
  constexpr std::size_t kChunk = 1 << 16;
  with_type(a.type, a.is_normalized, [&]<typename T, bool is_normalized>(T, std::bool_constant<is_normalized>) {
    for (std::size_t begin = 0; from->base != nullptr && begin < count; begin += kChunk) {
      file_.steps().take(kChunk / 64);
      const std::size_t n = std::min(kChunk, count - begin);
      std::byte* to = out + begin * element;
      if (!which.empty()) {
        for (std::size_t i = 0; i < n; ++i)
          convert<T, is_normalized>(from->base + which[begin + i] * a.stride, floats, to + i * element);
      } else if (std::is_same_v<T, float> && a.stride == element) {
        std::memcpy(to, from->base + begin * element, n * element);
      } else {
        // With a number of components that the compiler knows, the inner loop goes.
        const char* first = from->base + begin * a.stride;
        if (floats == 3) convert_run<T, is_normalized>(first, a.stride, n, 3, to);
        if (floats == 2) convert_run<T, is_normalized>(first, a.stride, n, 2, to);
        if (floats != 3 && floats != 2) convert_run<T, is_normalized>(first, a.stride, n, floats, to);
      }
    }
    if (!a.sparse) return;
    const auto replace = [&](std::uint64_t i, std::size_t slot) {
      file_.steps().take();
      convert<T, is_normalized>(from->sparse_values + i * a.element_size(), floats, out + slot * element);
    };
    const auto index_of = [&](std::uint64_t i) { return index_at(from->sparse_indices, a.sparse->index_type, i); };
    if (which.empty()) {
      for (std::uint64_t i = 0; i < a.sparse->count; ++i) replace(i, index_of(i));
      return;
    }
    // Many primitives may each use a few of many values.
    const auto all = std::views::iota(std::uint64_t{0}, a.sparse->count);
    for (std::size_t slot = 0; slot < which.size(); ++slot) {
      const auto found = std::ranges::lower_bound(all, which[slot], {}, index_of);
      if (found != all.end() && index_of(*found) == which[slot]) replace(*found, slot);
    }
  });
  return true;
}

bool Accessors::read_indices(std::uint32_t index, std::span<std::uint32_t> out) {
  Accessor& a = accessors_[index];
  const auto from = source(a);
  if (!from) return false;
  if (a.sparse && !check_sparse(a, from->sparse_indices)) return false;
  const std::size_t count = std::min<std::size_t>(a.count, out.size());
  if (from->base == nullptr) {
    std::ranges::fill(out, 0);
  } else if (a.type == ComponentType::uint32 && a.stride == sizeof(std::uint32_t)) {
    std::memcpy(out.data(), from->base, count * sizeof(std::uint32_t));
  } else {
    with_type(a.type, false, [&]<typename T>(T, auto) {
      for (std::size_t i = 0; i < count; ++i) out[i] = static_cast<std::uint32_t>(load<T>(from->base + i * a.stride));
    });
  }
  file_.steps().take(count / 64);
  if (!a.sparse) return true;
  for (std::uint64_t i = 0; i < a.sparse->count; ++i) {
    const std::uint32_t at = index_at(from->sparse_indices, a.sparse->index_type, i);
    if (at < count) out[at] = index_at(from->sparse_values, a.type, i);
  }
  return true;
}

}  // namespace tessera::proto
