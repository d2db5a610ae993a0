#include "client/commands/image_arguments.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <string_view>
#include <utility>

#include <CLI/CLI.hpp>

#include "client/output_file.h"

namespace tessera::client {
namespace {

constexpr std::pair<std::string_view, std::string_view> kFormatByEnding[] = {
    {".png", "png"}, {".jpg", "jpeg"}, {".jpeg", "jpeg"}, {".exr", "exr"}, {".hdr", "hdr"}};

std::string format_by_ending(const std::string& output) {
  std::string ending = std::filesystem::path(output).extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
  for (const auto& [known, format] : kFormatByEnding)
    if (ending == known) return std::string(format);
  throw CLI::ValidationError(
      "-o", "can't tell a format by the ending of " + output + ": use .png, .jpg, .exr or .hdr, or say --format");
}

}  // namespace

void ImageArguments::add_to(CLI::App& command) {
  command.add_option("-o,--output", output, "The image file")->capture_default_str();
  command.add_option("--format", image.format, "png, jpeg, exr or hdr; by the output's ending when not given");
}

void ImageArguments::check() {
  if (image.format.empty()) image.format = format_by_ending(output);
  expect_writable(output);
}

void ImageArguments::save(const Client& client, const std::string& id) const {
  write_atomically(output, client.fetch(id, image));
}

}  // namespace tessera::client
