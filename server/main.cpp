#include <exception>
#include <iostream>
#include <variant>

#include "server/config.h"
#include "server/daemon.h"
#include "server/http/router.h"
#include "server/scrub.h"

int main(int argc, char** argv) try {
  using namespace tessera::server;
  const auto read = [&](std::ostream& out, std::ostream& errors) { return parse_config(argc, argv, out, errors); };
  const auto parsed = read(std::cout, std::cerr);
  if (const int* status = std::get_if<int>(&parsed)) return *status;
  const Config& config = std::get<Config>(parsed);
  if (config.print_routes) {
    std::cout << describe_routes();
    return 0;
  }
  if (config.scrub) return scrub(config, std::cout, std::cerr);
  return run_daemon(config, read);
} catch (const std::exception& error) {
  std::cerr << error.what() << std::endl;
  return 1;
}
