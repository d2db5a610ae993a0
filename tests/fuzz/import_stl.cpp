#include <cstdio>
#include <cstdlib>
#include <string>

#include "tests/support/fuzz_main.h"
#include "tests/support/import_checks.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  const std::string fault = tessera::fault_of_reading(tessera::proto::FileFormat::stl, bytes);
  if (fault.empty()) return 0;
  std::fprintf(stderr, "%s\n", fault.c_str());
  std::abort();
}
