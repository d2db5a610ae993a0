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
  command.add_option("--exposure", image.exposure, "Stops by which a PNG or JPEG is brighter, from -64 to 64")
      ->check(CLI::Range(-64.0, 64.0));
  command.add_option("--tone-map", image.tone_map, "Of a PNG or JPEG: none, khronos_pbr_neutral or aces")
      ->check(CLI::IsMember({"none", "khronos_pbr_neutral", "aces"}));
  command.add_option(
      "--background", image.background,
      "Behind what is transparent in a PNG or JPEG: a colour as six hexadecimal digits, white, black, or "
      "transparent; of a model that render sends, white unless said, or environment for what lights it");
  command.add_option("--precision", image.precision, "Of an EXR's floats: float, or half, which is smaller")
      ->check(CLI::IsMember({"half", "float"}));
}

void ImageArguments::check() {
  if (image.format.empty()) image.format = is_stdout() ? "png" : format_by_ending(output);
  expect_fitting_format();
  if (!is_stdout()) return expect_writable(output);
  if (isatty(STDOUT_FILENO) != 0)
    throw CLI::ValidationError("-o", "an image is nothing for a terminal: redirect stdout, or name a file");
}

void ImageArguments::expect_fitting_format() const {
  const bool is_shown = is_for_display();
  if (!image.exposure.empty() && !is_shown)
    throw CLI::ValidationError("--exposure", "only PNG and JPEG have it; " + image.format + " holds light as it is");
  if (!image.tone_map.empty() && !is_shown)
    throw CLI::ValidationError("--tone-map", "only PNG and JPEG have it; " + image.format + " holds light as it is");
  if (!image.background.empty() && !is_shown)
    throw CLI::ValidationError("--background",
                               "only PNG and JPEG have it; " + image.format + " holds what is transparent");
  if (!image.precision.empty() && image.format != "exr")
    throw CLI::ValidationError("--precision", "only EXR has it, and the image comes as " + image.format);
}

void ImageArguments::save(const Client& client, const std::string& id) const {
  const std::string bytes = client.fetch(id, image);
  if (!is_stdout()) return write_atomically(output, bytes);
  if (const std::error_code error = write_to_stdout(bytes))
    throw Failure(Failure::Kind::local_file, "can't write the image to stdout: " + error.message());
}

}  // namespace tessera::client
