#include "proto/import/gltf/draco.h"

#include <array>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <draco/compression/config/decoder_options.h>
#include <draco/compression/mesh/mesh_edgebreaker_decoder.h>
#include <draco/compression/mesh/mesh_sequential_decoder.h>
#include <draco/core/decoder_buffer.h>
#include <draco/core/varint_decoding.h>
#include <draco/mesh/mesh.h>
#include <draco/metadata/metadata_decoder.h>

namespace tessera::proto {
namespace {

/// What a mesh takes while Draco decodes its connectivity, for each of its parts; and its faces for every attribute
/// that has a connectivity of its own.
constexpr std::uint64_t kBytesOfFace = 100, kBytesOfVertex = 64, kBytesOfSeams = 40;
/// Metadata, say, is read whether or not it's of any use.
constexpr std::uint64_t kBytesOfByte = 8;

/// How many faces and vertices the data says that it holds, before anything is allocated for them (Draco's bitstream
/// specification, version 2.2, which glTF asks for).
struct Counts {
  bool is_edgebreaker = false;
  std::uint32_t faces = 0, vertices = 0;
  std::uint8_t connectivities = 0;  ///< Of attributes, beside the mesh's.

  std::uint64_t bytes() const {
    return faces * (kBytesOfFace + connectivities * kBytesOfSeams) + vertices * kBytesOfVertex;
  }
};
std::optional<Counts> read_counts(std::string_view bytes) {
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  draco::DracoHeader header{};
  std::array<char, 5> magic{};
  Counts counts;
  if (!buffer.Decode(magic.data(), magic.size()) || std::string_view(magic.data(), magic.size()) != "DRACO" ||
      !buffer.Decode(&header.version_major) || !buffer.Decode(&header.version_minor) ||
      !buffer.Decode(&header.encoder_type) || !buffer.Decode(&header.encoder_method) || !buffer.Decode(&header.flags))
    return std::nullopt;
  if (header.version_major != 2 || header.version_minor != 2) return std::nullopt;
  if (header.encoder_type != draco::TRIANGULAR_MESH) return std::nullopt;
  buffer.set_bitstream_version(DRACO_BITSTREAM_VERSION(2, 2));
  draco::GeometryMetadata metadata;
  if ((header.flags & METADATA_FLAG_MASK) != 0 && !draco::MetadataDecoder().DecodeGeometryMetadata(&buffer, &metadata))
    return std::nullopt;
  std::uint8_t traversal = 0;
  counts.is_edgebreaker = header.encoder_method == draco::MESH_EDGEBREAKER_ENCODING;
  if (!counts.is_edgebreaker) {
    if (header.encoder_method != draco::MESH_SEQUENTIAL_ENCODING) return std::nullopt;
    if (!draco::DecodeVarint(&counts.faces, &buffer) || !draco::DecodeVarint(&counts.vertices, &buffer))
      return std::nullopt;
    return counts;
  }
  if (!buffer.Decode(&traversal) || !draco::DecodeVarint(&counts.vertices, &buffer) ||
      !draco::DecodeVarint(&counts.faces, &buffer) || !buffer.Decode(&counts.connectivities))
    return std::nullopt;
  return counts;
}

/// A decoder that asks before it allocates the attributes.
template <typename Decoder>
class Bounded : public Decoder {
 public:
  Bounded(GltfFile& file, const JsonCursor& where) : file_(file), where_(where) {}

 protected:
  bool DecodeAllAttributes() override {
    std::uint64_t bytes = 0;
    const draco::Mesh& mesh = *this->mesh();
    for (int i = 0; i < mesh.num_attributes(); ++i) {
      const draco::PointAttribute& attribute = *mesh.attribute(i);
      bytes += attribute.num_components() * (draco::DataTypeLength(attribute.data_type()) + sizeof(std::uint64_t));
    }
    return file_.take(bytes * mesh.num_points(), where_) && Decoder::DecodeAllAttributes();
  }

 private:
  GltfFile& file_;
  const JsonCursor& where_;
};

class DracoReader {
 public:
  DracoReader(const Primitive& primitive, Accessors& accessors, GltfFile& file)
      : primitive_(primitive), accessors_(accessors), file_(file), where_(primitive.draco->where) {}

  std::optional<GltfTriangles> read(std::string_view bytes) {
    if (!decode(bytes)) return std::nullopt;
    if (mesh_.num_points() != accessors_[*primitive_.position].count ||
        (primitive_.indices && mesh_.num_faces() * 3ULL != accessors_[*primitive_.indices].count &&
         primitive_.topology == Topology::triangles))
      file_.note(where_, "A compressed mesh holds more or fewer vertices or triangles than its accessors say");
    if (!file_.take(mesh_.num_faces() * sizeof(TriangleIndices) + mesh_.num_points() * kBytesOfVertex, where_))
      return std::nullopt;
    read_faces();
    out_.mesh.positions = read<Vec3>("POSITION", primitive_.position);
    out_.mesh.normals = read<Vec3>("NORMAL", primitive_.normal);
    out_.attributes.uvs[0] = read<Vec2>("TEXCOORD_0", primitive_.uvs[0]);
    out_.attributes.uvs[1] = read<Vec2>("TEXCOORD_1", primitive_.uvs[1]);
    if (primitive_.normal) out_.attributes.tangents = read<Tangent>("TANGENT", primitive_.tangent);
    read_colors();
    if (primitive_.joints && primitive_.weights) {
      out_.joints = read<std::array<float, 4>>("JOINTS_0", primitive_.joints);
      out_.weights = read<std::array<float, 4>>("WEIGHTS_0", primitive_.weights);
    }
    if (!file_.errors().empty()) return std::nullopt;
    return std::move(out_);
  }

 private:
  bool decode(std::string_view bytes) {
    if (!file_.take(bytes.size() * kBytesOfByte, where_)) return false;
    const auto counts = read_counts(bytes);
    if (!counts) return where_.error("This isn't a mesh compressed by Draco, version 2.2 of its format.");
    if (!file_.take(counts->bytes(), where_)) return false;
    draco::DecoderBuffer buffer;
    buffer.Init(bytes.data(), bytes.size());
    const draco::DecoderOptions options;
    draco::Status status;
    if (counts->is_edgebreaker) {
      status = Bounded<draco::MeshEdgebreakerDecoder>(file_, where_).Decode(options, &buffer, &mesh_);
    } else {
      status = Bounded<draco::MeshSequentialDecoder>(file_, where_).Decode(options, &buffer, &mesh_);
    }
    file_.steps().take(mesh_.num_faces());
    return status.ok() || where_.error("The compressed mesh is broken: " + status.error_msg_string() + ".");
  }

  void read_faces() {
    out_.mesh.triangles.reserve(mesh_.num_faces());
    for (draco::FaceIndex i(0); i < mesh_.num_faces(); ++i) {
      const auto& face = mesh_.face(i);
      const TriangleIndices t{face[0].value(), face[1].value(), face[2].value()};
      for (const std::uint32_t corner : t) {
        if (corner < mesh_.num_points()) continue;
        where_.error("The compressed mesh is broken: a triangle has a corner that isn't there.");
        return;
      }
      out_.mesh.triangles.push_back(t);
    }
  }

  /// The attribute's values; of one that isn't compressed, those of its own accessor.
  template <typename Element>
  std::vector<Element> read(std::string_view name, const std::optional<std::uint32_t>& accessor) {
    if (!accessor) return {};
    const auto id = primitive_.draco->ids.find(name);
    if (id == primitive_.draco->ids.end()) {
      if (accessors_[*accessor].count == mesh_.num_points()) return accessors_.read<Element>(*accessor);
      file_.note(where_, "An attribute that isn't compressed as its mesh is, and doesn't fit it, is left out");
      if (name == "POSITION") where_.error("The compressed mesh has no positions.");
      return {};
    }
    const draco::PointAttribute* attribute = mesh_.GetAttributeByUniqueId(id->second);
    if (attribute == nullptr) {
      where_.error("The compressed mesh has no attribute " + std::to_string(id->second) + ".");
      return {};
    }
    using Numbers = std::array<float, sizeof(Element) / sizeof(float)>;
    std::vector<Element> out(mesh_.num_points());
    const float scale = scale_of(accessors_[*accessor], *attribute);
    for (draco::PointIndex i(0); i < mesh_.num_points(); ++i) {
      const draco::AttributeValueIndex value = attribute->mapped_index(i);
      Numbers numbers{};
      if (value.value() >= attribute->size() ||
          !attribute->ConvertValue<float>(value, static_cast<std::int8_t>(numbers.size()), numbers.data())) {
        where_.error("The compressed mesh is broken: an attribute has too few values.");
        return {};
      }
      for (float& number : numbers) number *= scale;
      out[i.value()] = std::bit_cast<Element>(numbers);
    }
    return out;
  }

  /// What integers are multiplied with that the accessor calls normalised, and the data doesn't.
  static float scale_of(const Accessor& accessor, const draco::PointAttribute& attribute) {
    if (!accessor.is_normalized || attribute.normalized()) return 1;
    switch (accessor.type) {
      case ComponentType::int8:
        return 1.0F / std::numeric_limits<std::int8_t>::max();
      case ComponentType::uint8:
        return 1.0F / std::numeric_limits<std::uint8_t>::max();
      case ComponentType::int16:
        return 1.0F / std::numeric_limits<std::int16_t>::max();
      case ComponentType::uint16:
        return 1.0F / std::numeric_limits<std::uint16_t>::max();
      default:
        return 1;
    }
  }

  void read_colors() {
    if (!primitive_.color) return;
    if (accessors_[*primitive_.color].components == 4) {
      out_.attributes.colors = read<std::array<float, 4>>("COLOR_0", primitive_.color);
      return;
    }
    for (const auto& [r, g, b] : read<std::array<float, 3>>("COLOR_0", primitive_.color))
      out_.attributes.colors.push_back({r, g, b, 1});
  }

  const Primitive& primitive_;
  Accessors& accessors_;
  GltfFile& file_;
  const JsonCursor& where_;
  draco::Mesh mesh_;
  GltfTriangles out_;
};

}  // namespace

std::optional<GltfTriangles> read_draco(const Primitive& primitive, Accessors& accessors, GltfBuffers& buffers,
                                        GltfFile& file) {
  const auto bytes = buffers.bytes(primitive.draco->view, primitive.draco->where);
  if (!bytes) return std::nullopt;
  return DracoReader(primitive, accessors, file).read(*bytes);
}

}  // namespace tessera::proto
