#include <exception>
#include <iostream>
#include <variant>

#include <spdlog/spdlog.h>

#include "server/config.h"
#include "server/daemon.h"
#include "server/router.h"

int main(int argc, char** argv) {
  using namespace tessera::server;
  const auto parsed = parse_config(argc, argv);
  if (const int* status = std::get_if<int>(&parsed)) return *status;
  const Config& config = std::get<Config>(parsed);
  if (config.print_routes) {
    std::cout << describe_routes();
    return 0;
  }
  try {
    run_daemon(config);
    return 0;
  } catch (const std::exception& error) {
    spdlog::critical("{}", error.what());
    return 1;
  }
}
