#include "core/io/read_environment.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "core/io/exr_header.h"
#include "core/io/oiio/load_module.h"
#include "core/io/oiio/oiio_module.h"

namespace tessera {
namespace {

bool begins_with(std::span<const std::byte> file, std::string_view magic) {
  return file.size() >= magic.size() && std::equal(magic.begin(), magic.end(), file.begin(),
                                                   [](char a, std::byte b) { return static_cast<std::byte>(a) == b; });
}

bool is_light(Rgb c) {
  const auto fits = [](float v) { return v >= 0 && v <= kLargestLight; };
  return fits(c.r) && fits(c.g) && fits(c.b);
}

}  // namespace

std::variant<EnvironmentMap, std::string> read_environment(std::span<const std::byte> file, std::uint64_t most_bytes) {
  const bool is_exr = begins_with(file, "\x76\x2f\x31\x01");
  if (!is_exr && !begins_with(file, "#?RADIANCE") && !begins_with(file, "#?RGBE"))
    return std::string("It is neither a Radiance (.hdr) nor an OpenEXR file.");
  if (is_exr)
    if (auto why = exr_header_problem(file, most_bytes / sizeof(Rgb))) return *std::move(why);
  static const auto kRead = oiio_function<decltype(&tessera_oiio_read)>("tessera_oiio_read");
  EnvironmentMap map;
  std::string problem;
  kRead(is_exr ? "map.exr" : "map.hdr", file, most_bytes, map, problem);
  if (!problem.empty()) return problem;
  const auto wrong = std::ranges::count_if(map.texels, [](Rgb c) { return !is_light(c); });
  if (wrong > 0)
    return std::to_string(wrong) + " of its " + std::to_string(map.texels.size()) +
           " texels are NaN, negative or above 1e18.";
  return map;
}

}  // namespace tessera
