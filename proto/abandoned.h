#pragma once

#include <exception>
#include <stop_token>

namespace tessera::proto {

/// Thrown where a stop is requested while a document or a file is read: nobody wants the result any more. The one
/// exception that leaves `parse_scene`, `parse_job` and `import_file`.
class Abandoned : public std::exception {
 public:
  const char* what() const noexcept override { return "Reading was abandoned"; }
};

/// To be called every some thousand steps of anything that may take long.
inline void throw_if_abandoned(const std::stop_token& stop) {
  if (stop.stop_requested()) throw Abandoned();
}

}  // namespace tessera::proto
