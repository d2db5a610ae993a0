#include "client/event_reader.h"

#include <utility>

namespace tessera::client {

void EventReader::add(std::string_view piece) {
  for (const char c : piece) {
    const bool follows_return = std::exchange(was_return_, c == '\r');
    if (c == '\n' && follows_return) continue;
    if (c == '\n' || c == '\r')
      end_line();
    else
      line_ += c;
  }
}

void EventReader::end_line() {
  const std::string line = std::exchange(line_, {});
  if (line.empty()) {
    const std::string type = std::exchange(type_, {});
    std::string data = std::exchange(data_, {});
    if (data.empty()) return;
    data.pop_back();  // The end of its last line.
    on_event_(type.empty() ? "message" : type, data);
    return;
  }
  const std::size_t colon = line.find(':');
  const std::string_view name = std::string_view(line).substr(0, colon);
  std::string_view value = colon == std::string::npos ? "" : std::string_view(line).substr(colon + 1);
  if (value.starts_with(' ')) value.remove_prefix(1);
  if (name == "event") type_ = value;
  if (name == "data") data_.append(value) += '\n';
}

}  // namespace tessera::client
