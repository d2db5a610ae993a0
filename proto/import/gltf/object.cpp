#include "proto/import/gltf/object.h"

#include <algorithm>
#include <string>

namespace tessera::proto {

GltfObject::GltfObject(JsonCursor value) : value_(value), is_object_(value.kind() == JsonKind::object) {
  if (!is_object_) {
    value.expected("an object");
    return;
  }
  if (const auto name = find("name"); name && name->kind() != JsonKind::string) name->expected("a string");
  check_extensions();
}

void GltfObject::check_extensions() const {
  const auto extensions = find("extensions");
  if (!extensions) return;
  if (extensions->kind() != JsonKind::object) {
    extensions->expected("an object");
    return;
  }
  extensions->each_member([](std::string_view, JsonCursor extension) {
    if (extension.kind() != JsonKind::object) extension.expected("an object");
  });
}

std::optional<JsonCursor> GltfObject::find(std::string_view name) const {
  return is_object_ ? value_.member(name) : std::nullopt;
}

std::optional<JsonCursor> GltfObject::required(std::string_view name) const {
  auto member = find(name);
  if (!member && is_object_) value_.error("The member \"" + std::string(name) + "\" is missing.");
  return member;
}

std::optional<GltfObject> GltfObject::object(std::string_view name) const {
  const auto member = find(name);
  if (!member) return std::nullopt;
  GltfObject object(*member);
  return object.is_object_ ? std::optional(object) : std::nullopt;
}

std::vector<JsonCursor> GltfObject::array(std::string_view name) const {
  std::vector<JsonCursor> elements;
  const auto member = find(name);
  if (!member) return elements;
  if (member->kind() != JsonKind::array || member->size() == 0) {
    member->expected("an array of at least one element");
    return elements;
  }
  elements.reserve(member->size());
  for (const JsonCursor& element : member->elements()) elements.push_back(element);
  return elements;
}

std::optional<GltfObject> GltfObject::extension(std::string_view name) const {
  const auto extensions = find("extensions");
  if (!extensions || extensions->kind() != JsonKind::object) return std::nullopt;
  const auto extension = extensions->member(name);
  if (!extension || extension->kind() != JsonKind::object) return std::nullopt;
  return GltfObject(*extension);
}

std::optional<std::uint32_t> read_reference(const std::optional<JsonCursor>& value, std::size_t count,
                                            std::string_view what) {
  if (!value) return std::nullopt;
  std::uint64_t index = 0;
  if (!read(*value, index, 0, UINT32_MAX)) return std::nullopt;
  if (index < count) return static_cast<std::uint32_t>(index);
  value->error("There is no " + std::string(what) + " " + std::to_string(index) + "; the file has " +
               std::to_string(count) + ".");
  return std::nullopt;
}

bool read_numbers(const std::optional<JsonCursor>& value, std::span<double> out, const NumberRange& range) {
  if (!value) return true;
  if (value->kind() != JsonKind::array || value->size() != out.size()) {
    return value->expected("an array of " + std::to_string(out.size()) + " numbers");
  }
  std::vector<double> numbers;
  for (const JsonCursor& element : value->elements()) {
    float number = 0;
    if (!read(element, number, range)) return false;
    numbers.push_back(element.number());
  }
  std::ranges::copy(numbers, out.begin());
  return true;
}

bool read_numbers(const std::optional<JsonCursor>& value, std::span<float> out, const NumberRange& range) {
  std::vector<double> numbers(out.size());
  if (!value || !read_numbers(value, numbers, range)) return !value;
  std::ranges::transform(numbers, out.begin(), [](double number) { return static_cast<float>(number); });
  return true;
}

}  // namespace tessera::proto
