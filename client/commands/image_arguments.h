#pragma once

#include <string>

#include "client/client.h"

namespace CLI {
class App;
}

namespace tessera::client {

/// Where an image goes and in which format, as `render` and `fetch` take it: a file, or "-" for stdout.
struct ImageArguments {
  std::string output;
  ImageRequest image{.format = ""};

  void add_to(CLI::App& command);

  bool is_stdout() const { return output == "-"; }

  /// Settles the format by the output's ending when none is given, PNG for stdout, and makes sure that it has what is
  /// asked of it, and that the output can be written and isn't a terminal: better known before a long wait. Throws
  /// `CLI::ValidationError`, `Failure`.
  void check();

  /// Whether it is shown, or holds light as it is.
  bool is_for_display() const { return image.format == "png" || image.format == "jpeg"; }

  /// Fetches the image and writes it, into a file whole or not at all.
  void save(const Client& client, const std::string& id) const;

 private:
  void expect_fitting_format() const;
};

}  // namespace tessera::client
