#include "client/event_reader.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

namespace tessera::client {
namespace {

using Events = std::vector<std::string>;

Events read(std::string_view text, std::size_t piece) {
  Events events;
  EventReader reader([&](std::string_view type, std::string_view data) {
    events.push_back(std::string(type) + '|' + std::string(data));
  });
  for (; !text.empty(); text.remove_prefix(std::min(piece, text.size()))) reader.add(text.substr(0, piece));
  return events;
}

TEST(EventReader, ReadsEventsInPiecesOfAnySize) {
  constexpr std::string_view kText =
      "retry: 2000\n\n:\n\nid: 1\nevent: state\ndata: {\"a\": 1}\n\ndata:no space\ndata:  two\n\nevent: nothing\n\n"
      "data: x\n\ndata: unfinished\n";
  const Events expected{"state|{\"a\": 1}", "message|no space\n two", "message|x"};
  for (const std::size_t piece : {1, 2, 3, 7, 1000}) EXPECT_EQ(read(kText, piece), expected) << piece;
}

TEST(EventReader, LinesEndAsTheStandardHasIt) {
  for (const std::size_t piece : {1, 1000}) {
    EXPECT_EQ(read("data: a\r\n\r\ndata: b\r\rdata: c\n\n", piece), (Events{"message|a", "message|b", "message|c"}));
    EXPECT_EQ(read("data\n\ndata: a\rdata: b\n\n", piece), (Events{"message|", "message|a\nb"}));
  }
}

}  // namespace
}  // namespace tessera::client
