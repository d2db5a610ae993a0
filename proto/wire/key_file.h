#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/wire/choice.h"
#include "proto/wire/sha256.h"

namespace tessera::proto {

/// What a key lets its bearer do: see what its owner has, send work and files and take them back, or all of that with
/// everybody's.
enum class Scope { read, submit, admin };
std::span<const Choice<Scope>> scope_names();

/// How much a key lets its bearer do; nothing for as much as the server takes.
struct KeyLimits {
  std::optional<double> requests_per_second;      ///< On average, > 0;
  std::optional<std::uint32_t> burst;             ///< and so many at once: those of a second without it.
  std::optional<std::uint32_t> unfinished_jobs;   ///< Of the key's owner.
  std::optional<std::uint64_t> samples_per_hour;  ///< Of all pixels of all jobs.
  std::optional<std::uint64_t> stored_bytes;      ///< Of the uploaded files that are the key's owner's.
};

/// A bearer key (RFC 6750), as it is kept: without what it takes to use it.
struct Key {
  using Time = std::chrono::sys_seconds;

  std::string id;     ///< Letters and digits, and no secret.
  std::string owner;  ///< Who has what is made with it; as `is_owner_name` lets pass.
  std::string name;   ///< For people; may be empty.
  std::set<Scope> scopes;
  /// Of the whole token. It has more random bits than anybody can try, so that a plain hash keeps it: slow ones with
  /// salt are for what people think of.
  ContentHash token_hash;
  Time created;
  std::optional<Time> expires, revoked;
  KeyLimits limits;

  bool is_valid(Time now) const { return !revoked && (!expires || now < *expires); }
};

/// 1 to 64 letters, digits, and - . _ @, beginning with a letter or a digit: names folders, too.
bool is_owner_name(std::string_view text);

/// A key's token, to be handed to its bearer and kept nowhere: "tsk_", the key's id, "_" and 256 random bits. Sets the
/// key's `id` and `token_hash`. Throws std::runtime_error where there is no randomness.
std::string make_token(Key& key);

/// The id of the key that a token is of, if it looks like one; empty otherwise.
std::string_view id_of_token(std::string_view token);

/// Whether a token is the one that a key's `token_hash` is of, found in a time that says nothing of how far it is
/// right.
bool fits(const ContentHash& token_hash, std::string_view token);

/// Where the keys of a data folder are.
std::filesystem::path key_file(const std::filesystem::path& data_dir);

/// The keys of a data folder; none where there is no file. Throws std::runtime_error, with the file and the place in
/// it, when it can't be read or isn't one.
std::vector<Key> read_keys(const std::filesystem::path& data_dir);

/// Changes the keys of a data folder, which is made where it is missing: all of it or nothing, whoever else does the
/// same and whatever happens meanwhile. The file is readable for the folder's owner alone. Throws std::runtime_error or
/// std::system_error, and what `change` throws, which leaves everything as it is.
void change_keys(const std::filesystem::path& data_dir, const std::function<void(std::vector<Key>&)>& change);

/// As "2026-11-30T12:00:00Z" (RFC 3339).
std::string to_text(Key::Time time);

}  // namespace tessera::proto
