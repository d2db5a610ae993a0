#include "proto/import/gltf/meshopt.h"

#include <meshoptimizer.h>

namespace tessera::proto {
namespace {

/// Whether the stream could hold that much, by the specification's "Bitstream": a byte a triangle or an index; two bits
/// for 16 bytes of attributes.
bool may_hold(const MeshoptView& view) {
  switch (view.mode) {
    case MeshoptMode::attributes:
      return view.count * view.stride / 64 <= view.length;
    case MeshoptMode::triangles:
      return view.count / 3 <= view.length;
    case MeshoptMode::indices:
      return view.count <= view.length;
  }
  return false;
}

/// What is wrong with the stride, by the extension's rules; empty when nothing is.
std::string_view fault_of_stride(const MeshoptView& view) {
  if (view.mode == MeshoptMode::attributes) {
    if (view.stride % 4 != 0 || view.stride > 256) return "The stride of attributes is a multiple of 4, at most 256.";
  } else if (view.stride != 2 && view.stride != 4) {
    return "The stride of indices is 2 or 4.";
  }
  if (view.filter == MeshoptFilter::octahedral && view.stride != 4 && view.stride != 8)
    return "The stride of octahedral data is 4 or 8.";
  if (view.filter == MeshoptFilter::quaternion && view.stride != 8) return "The stride of quaternions is 8.";
  return "";
}

}  // namespace

bool read_meshopt(const GltfObject& extension, std::uint64_t length, std::optional<std::uint32_t> stride,
                  MeshoptView& out) {
  const auto stride_field = extension.required("byteStride"), count = extension.required("count"),
             mode = extension.required("mode"), filter = extension.find("filter");
  bool good =
      stride_field && count && mode && read(stride_field, out.stride, 1, 256) && read(count, out.count, 1, UINT32_MAX);
  good = good && read<MeshoptMode>(mode, out.mode,
                                   {{"ATTRIBUTES", MeshoptMode::attributes},
                                    {"TRIANGLES", MeshoptMode::triangles},
                                    {"INDICES", MeshoptMode::indices}});
  good = good && read<MeshoptFilter>(filter, out.filter,
                                     {{"NONE", MeshoptFilter::none},
                                      {"OCTAHEDRAL", MeshoptFilter::octahedral},
                                      {"QUATERNION", MeshoptFilter::quaternion},
                                      {"EXPONENTIAL", MeshoptFilter::exponential}});
  if (!good) return false;
  if (const std::string_view fault = fault_of_stride(out); !fault.empty())
    return stride_field->error(std::string(fault));
  if (stride && *stride != out.stride) return stride_field->error("The view itself has another stride.");
  if (out.mode != MeshoptMode::attributes && out.filter != MeshoptFilter::none)
    return filter->error("Only attributes are filtered.");
  if (out.mode == MeshoptMode::triangles && out.count % 3 != 0) return count->error("A triangle has three indices.");
  if (out.count * out.stride != length) {
    return count->error("The view has " + std::to_string(length) + " bytes, not " +
                        std::to_string(out.count * out.stride) + ".");
  }
  return may_hold(out) || count->error("So few bytes can't hold so many elements.");
}

bool decode_meshopt(const MeshoptView& view, std::string_view encoded, std::string& out, std::string& why) {
  out.resize(view.count * view.stride);
  const auto* bytes = reinterpret_cast<const unsigned char*>(encoded.data());
  int fault = 0;
  switch (view.mode) {
    case MeshoptMode::attributes:
      fault = meshopt_decodeVertexBuffer(out.data(), view.count, view.stride, bytes, encoded.size());
      break;
    case MeshoptMode::triangles:
      fault = meshopt_decodeIndexBuffer(out.data(), view.count, view.stride, bytes, encoded.size());
      break;
    case MeshoptMode::indices:
      fault = meshopt_decodeIndexSequence(out.data(), view.count, view.stride, bytes, encoded.size());
      break;
  }
  if (fault != 0) {
    why = "The compressed data is broken.";
    out.clear();
    return false;
  }
  switch (view.filter) {
    case MeshoptFilter::none:
      break;
    case MeshoptFilter::octahedral:
      meshopt_decodeFilterOct(out.data(), view.count, view.stride);
      break;
    case MeshoptFilter::quaternion:
      meshopt_decodeFilterQuat(out.data(), view.count, view.stride);
      break;
    case MeshoptFilter::exponential:
      meshopt_decodeFilterExp(out.data(), view.count, view.stride);
      break;
  }
  return true;
}

}  // namespace tessera::proto
