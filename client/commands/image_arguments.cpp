#include "client/commands/image_arguments.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <string_view>
#include <utility>

#include <CLI/CLI.hpp>
#include <unistd.h>

#include "client/failure.h"
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
  command.add_option("-o,--output", output, "The image file, or - for stdout")->capture_default_str();
  command.add_option("--format", image.format, "png, jpeg, exr or hdr; by the output's ending when not given")
      ->check(CLI::IsMember({"png", "jpeg", "exr", "hdr"}));
}

void ImageArguments::check() {
  if (is_stdout()) {
    if (image.format.empty()) image.format = "png";
    if (isatty(STDOUT_FILENO) != 0)
      throw CLI::ValidationError("-o", "an image is nothing for a terminal: redirect stdout, or name a file");
    return;
  }
  if (image.format.empty()) image.format = format_by_ending(output);
  expect_writable(output);
}

void ImageArguments::save(const Client& client, const std::string& id) const {
  const std::string bytes = client.fetch(id, image);
  if (!is_stdout()) return write_atomically(output, bytes);
  if (const std::error_code error = write_to_stdout(bytes))
    throw Failure(Failure::Kind::local_file, "can't write the image to stdout: " + error.message());
}

}  // namespace tessera::client
