#include "proto/import/gltf/buffers.h"

#include <utility>

#include "proto/wire/uri.h"

namespace tessera::proto {
namespace {

constexpr std::uint64_t kLargest = 1ULL << 53;
constexpr std::uint32_t kVertexTarget = 34962, kIndexTarget = 34963;

std::string_view name_of(ViewUse use) {
  switch (use) {
    case ViewUse::vertices:
      return "vertex attributes";
    case ViewUse::indices:
      return "indices";
    default:
      return "other data";
  }
}

}  // namespace

GltfBuffers::GltfBuffers(GltfFile& file, const GltfParts& parts) : file_(file) {
  const GltfObject root = file.root();
  for (const JsonCursor& buffer : root.array("buffers")) read_buffer(GltfObject(buffer), parts);
  for (const JsonCursor& view : root.array("bufferViews")) read_view(GltfObject(view));
}

void GltfBuffers::read_buffer(const GltfObject& object, const GltfParts& parts) {
  const bool is_in_glb = parts.is_glb && buffers_.empty();
  Buffer& buffer = buffers_.emplace_back();
  const auto length = object.required("byteLength"), uri = object.find("uri");
  if (!read(length, buffer.length, 1, kLargest)) return;
  if (uri) {
    if (auto bytes = read_uri(*uri)) buffer.bytes = *owned_.emplace_back(std::move(bytes));
  } else if (is_in_glb) {
    buffer.bytes = parts.binary;
    if (!parts.binary) object.value().error("The GLB has no binary chunk for this buffer.");
  }
  if (buffer.bytes && length && buffer.bytes->size() < buffer.length) {
    object.value().error("The buffer has only " + std::to_string(buffer.bytes->size()) + " bytes, not " +
                         std::to_string(buffer.length) + ".");
  }
}

std::shared_ptr<const std::string> GltfBuffers::read_uri(const JsonCursor& uri) {
  if (uri.kind() != JsonKind::string) {
    uri.expected("a URI");
    return nullptr;
  }
  if (is_data_uri(uri.string())) {
    auto read = read_data_uri(uri.string());
    if (const auto* why = std::get_if<std::string>(&read)) {
      uri.error("This data: URI can't be read: " + *why + ".");
      return nullptr;
    }
    auto& data = std::get<DataUri>(read);
    if (data.media_type != "application/octet-stream" && data.media_type != "application/gltf-buffer") {
      uri.error("A buffer's data: URI has the media type application/octet-stream or application/gltf-buffer, not " +
                in_quotes(data.media_type) + ".");
      return nullptr;
    }
    return std::make_shared<const std::string>(std::move(data.bytes));
  }
  std::string why;
  const auto companion = file_.find_companion(uri.string(), why);
  auto bytes = companion ? file_.read_companion(*companion, why) : nullptr;
  if (!bytes) uri.error(why + '.');
  return bytes;
}

/// Of a view, or of what a compressed one is decoded from.
bool GltfBuffers::read_range(const GltfObject& object, std::uint32_t& buffer, std::uint64_t& offset,
                             std::uint64_t& length) {
  const auto found = read_reference(object.required("buffer"), buffers_.size(), "buffer");
  const auto length_field = object.required("byteLength");
  const bool good = read(object.find("byteOffset"), offset, 0, kLargest) && read(length_field, length, 0, kLargest);
  if (!found || !length_field || !good) return false;
  buffer = *found;
  if (offset + length <= buffers_[buffer].length) return true;
  return length_field->error("The view's bytes " + std::to_string(offset) + " to " + std::to_string(offset + length) +
                             " lie beyond its buffer's " + std::to_string(buffers_[buffer].length) + ".");
}

void GltfBuffers::read_view(const GltfObject& object) {
  BufferView& view = views_.emplace_back(BufferView{.where = object.value()});
  if (!read_range(object, view.buffer, view.offset, view.length)) view.length = 0;
  read_stride(object, view);
  std::uint32_t target = 0;
  if (const auto given = object.find("target"); given && read(*given, target, 0, UINT32_MAX)) {
    if (target == kVertexTarget) view.use = ViewUse::vertices;
    if (target == kIndexTarget) view.use = ViewUse::indices;
  }
  if (const auto extension = object.extension("EXT_meshopt_compression")) {
    MeshoptView compressed{.where = extension->value()};
    if (read_range(*extension, compressed.buffer, compressed.offset, compressed.length) &&
        read_meshopt(*extension, view.length, view.stride, compressed)) {
      view.compressed = compressed;
    }
  } else if (view.length == 0) {
    file_.note(object.value(), "An empty buffer view is ignored");
  }
}

void GltfBuffers::read_stride(const GltfObject& object, BufferView& view) {
  const auto given = object.find("byteStride");
  std::uint32_t stride = 0;
  if (!given || !read(*given, stride, 4, 252)) return;
  if (stride % 4 != 0) {
    given->error("A stride is a multiple of 4, not " + std::to_string(stride) + ".");
  } else if (stride > view.length) {
    given->error("The stride of " + std::to_string(stride) + " is longer than the view itself.");
  } else {
    view.stride = stride;
  }
  std::uint32_t target = kVertexTarget;
  if (const auto field = object.find("target"); read(field, target, 0, UINT32_MAX) && target != kVertexTarget)
    given->error("Only views of vertex attributes have a stride.");
}

std::optional<std::string_view> GltfBuffers::bytes(std::uint32_t index, const JsonCursor& where) {
  BufferView& view = views_[index];
  const std::uint32_t source = view.compressed ? view.compressed->buffer : view.buffer;
  const auto& buffer = buffers_[source].bytes;
  if (!buffer) {
    where.error("The data isn't there: buffer " + std::to_string(source) + " has no URI.");
    return std::nullopt;
  }
  if (!view.compressed) return buffer->substr(view.offset, view.length);
  if (view.decoded.empty() && view.length > 0) {
    const MeshoptView& compressed = *view.compressed;
    const std::string_view encoded = buffer->substr(compressed.offset, compressed.length);
    if (!file_.take(view.length, compressed.where)) return std::nullopt;
    std::string why;
    if (!decode_meshopt(compressed, encoded, view.decoded, why)) {
      compressed.where.error(why);
      return std::nullopt;
    }
  }
  return view.decoded;
}

bool GltfBuffers::has_bytes(std::uint32_t index) const {
  const BufferView& view = views_[index];
  return buffers_[view.compressed ? view.compressed->buffer : view.buffer].bytes.has_value();
}

bool GltfBuffers::use(std::uint32_t index, ViewUse use, const JsonCursor& where) {
  BufferView& view = views_[index];
  if (use != ViewUse::vertices && view.stride && !view.compressed)
    return where.error("It lies in buffer view " + std::to_string(index) + ", which has a stride, as only " +
                       std::string(name_of(ViewUse::vertices)) + " may.");
  if (view.use == ViewUse::none) view.use = use;
  if (view.use == use) return true;
  return where.error("It lies in buffer view " + std::to_string(index) + ", which is there for " +
                     std::string(name_of(view.use)) + ", not for " + std::string(name_of(use)) + ".");
}

}  // namespace tessera::proto
