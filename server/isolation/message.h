#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/store/file_descriptor.h"

namespace tessera::server {

/// What two processes tell each other at once, with open files.
struct Message {
  std::uint32_t kind = 0;
  std::string body;
  std::vector<FileDescriptor> files;
};

constexpr std::size_t kLongestBody = 128 << 10;
constexpr std::size_t kMostFilesSent = 4;

/// Two ends of a channel (unix(7), SOCK_SEQPACKET). Throws std::system_error.
std::pair<FileDescriptor, FileDescriptor> make_channel();

/// False where nobody is at the other end. Whoever sends at the same time doesn't mingle. Precondition: the body isn't
/// longer than `kLongestBody`, and the files are at most `kMostFilesSent`.
bool send_message(int channel, std::uint32_t kind, std::string_view body, std::span<const int> files = {});

/// The same where the other end may not listen: false, too, where it doesn't.
bool try_to_send_message(int channel, std::uint32_t kind, std::string_view body);

/// The next message, which is waited for; nothing where nobody is at the other end, or what comes is no message.
std::optional<Message> receive_message(int channel);

}  // namespace tessera::server
