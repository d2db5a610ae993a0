#include "proto/import/environment.h"

#include <new>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

#include "core/io/read_environment.h"
#include "proto/import/broken_file.h"
#include "proto/import/read_file.h"
#include "proto/wire/printable.h"

namespace tessera::proto {
namespace {

/// Larger than any map that fits into a scene's memory.
constexpr std::uintmax_t kLargestMap = 4ULL << 30;

Problem cannot_read(std::string_view name, const std::string& why) {
  const std::string detail = printable(std::string(name) + " can't be read as an environment: " + why);
  return {ProblemCode::invalid_document, detail.ends_with('.') ? detail : detail + '.', {}};
}

}  // namespace

Result<std::shared_ptr<const EnvironmentMap>> import_environment(const InputFile& file, std::string_view display_name,
                                                                 std::uint64_t max_bytes, std::stop_token stop) {
  try {
    const std::string bytes = read_file(file, display_name, kLargestMap, stop);
    auto read = read_environment(std::as_bytes(std::span(bytes)), max_bytes);
    if (const auto* why = std::get_if<std::string>(&read)) return cannot_read(display_name, *why);
    return std::make_shared<const EnvironmentMap>(std::get<EnvironmentMap>(std::move(read)));
  } catch (const BrokenFile& broken) {
    return cannot_read(display_name, broken.errors.front().detail);
  } catch (const std::bad_alloc&) {
    return Problem{
        ProblemCode::out_of_memory_budget, "There is no memory left to read " + std::string(display_name) + '.', {}};
  } catch (const ModuleMissing& error) {
    return Problem{ProblemCode::internal_error, error.what(), {}};
  } catch (const std::runtime_error& error) {
    return cannot_read(display_name, error.what());
  }
}

}  // namespace tessera::proto
