#include <string_view>

#include "tests/support/fuzz_main.h"
#include "tests/support/http_checks.h"

/// The first line says in what pieces the rest comes from a client: a piece's size by the last five bits of a character
/// each, again and again.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tessera;
  const std::string_view input(reinterpret_cast<const char*>(data), size);
  const std::string_view sizes = input.substr(0, input.find('\n'));
  const std::string_view bytes = input.substr(std::min(sizes.size() + 1, input.size()));
  server::Conversation at_once, in_pieces;
  at_once.receive(bytes);
  std::size_t piece = 0;
  for (std::string_view rest = bytes; !rest.empty();) {
    const std::size_t count = sizes.empty() ? 1 : 1 + (sizes[piece++ % sizes.size()] & 31);
    in_pieces.receive(rest.substr(0, count));
    rest.remove_prefix(std::min(count, rest.size()));
  }
  check_same(at_once, in_pieces);
  for (const server::ReceivedRequest& request : at_once.requests()) check_request(request);
  if (at_once.refusal()) check_response(server::problem_response(*at_once.refusal()));
  return 0;
}
