#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <utility>

namespace tessera::client {

/// Reads server-sent events (https://html.spec.whatwg.org/multipage/server-sent-events.html) as they come, in pieces of
/// any size.
class EventReader {
 public:
  /// Called with the event's type, "message" where it has none, and its data.
  using OnEvent = std::function<void(std::string_view type, std::string_view data)>;

  explicit EventReader(OnEvent on_event) : on_event_(std::move(on_event)) {}

  void add(std::string_view piece);

 private:
  void end_line();

  OnEvent on_event_;
  std::string line_, type_, data_;
  bool was_return_ = false;  ///< The last character was a carriage return, which ends a line by itself.
};

}  // namespace tessera::client
