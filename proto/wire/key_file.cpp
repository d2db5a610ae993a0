#include "proto/wire/key_file.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <system_error>
#include <type_traits>
#include <utility>

#include <fcntl.h>
#include <nlohmann/json.hpp>
#include <openssl/crypto.h>
#include <openssl/rand.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace tessera::proto {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr Choice<Scope> kScopes[] = {{"read", Scope::read}, {"submit", Scope::submit}, {"admin", Scope::admin}};
constexpr int kVersion = 1;

constexpr std::string_view kPrefix = "tsk_";
constexpr std::string_view kAlphabet = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz";
constexpr std::size_t kIdLength = 12;
constexpr std::size_t kSecretLength = 43;  // Of 62 characters: 256 bits.
constexpr std::size_t kLongestOwner = 64;

bool is_alphanumeric(char c) { return kAlphabet.find(c) != std::string_view::npos; }

std::string random_characters(std::size_t count) {
  std::string text;
  while (text.size() < count) {
    std::array<unsigned char, 64> bytes;
    if (RAND_bytes(bytes.data(), bytes.size()) != 1) throw std::runtime_error("OpenSSL has no random numbers");
    for (const unsigned char byte : bytes)
      // Only as many values as make every character equally likely.
      if (byte < 4 * kAlphabet.size() && text.size() < count) text += kAlphabet[byte % kAlphabet.size()];
    OPENSSL_cleanse(bytes.data(), bytes.size());
  }
  return text;
}

// ---- The file's JSON.

/// What is wrong with it, and where.
[[noreturn]] void refuse(const std::string& place, const std::string& why) {
  throw std::runtime_error(place + ": " + why);
}

/// Takes members off an object; at the end, what is left isn't known.
class Members {
 public:
  Members(json object, std::string place) : members_(std::move(object)), place_(std::move(place)) {
    if (!members_.is_object()) refuse(place_, "this isn't an object");
  }

  /// Null where it is absent.
  json take(const char* name) {
    const auto found = members_.find(name);
    if (found == members_.end()) return nullptr;
    json value = std::move(*found);
    members_.erase(found);
    return value;
  }
  std::string take_text(const char* name) {
    const json value = take(name);
    if (!value.is_string()) refuse(at(name), "a string has to be here");
    return value.get<std::string>();
  }
  std::optional<Key::Time> take_time(const char* name) {
    const json value = take(name);
    if (value.is_null()) return std::nullopt;
    const std::string text = value.is_string() ? value.get<std::string>() : "";
    std::tm parts{};
    int end = 0;
    if (std::sscanf(text.c_str(), "%4d-%2d-%2dT%2d:%2d:%2dZ%n", &parts.tm_year, &parts.tm_mon, &parts.tm_mday,
                    &parts.tm_hour, &parts.tm_min, &parts.tm_sec, &end) != 6 ||
        static_cast<std::size_t>(end) != text.size())
      refuse(at(name), "write a time as 2026-11-30T12:00:00Z");
    parts.tm_year -= 1900;
    parts.tm_mon -= 1;
    const Key::Time time{std::chrono::seconds(::timegm(&parts))};
    if (to_text(time) != text) refuse(at(name), "there is no such time");
    return time;
  }
  template <typename T>
  std::optional<T> take_number(const char* name) {
    const json value = take(name);
    if (value.is_null()) return std::nullopt;
    constexpr auto kMost = static_cast<double>(std::numeric_limits<T>::max());
    const bool is_right = std::is_integral_v<T> ? value.is_number_unsigned() : value.is_number();
    if (!is_right || value.get<double>() > kMost || value.get<double>() < 0)
      refuse(at(name), "a number that isn't negative has to be here, or nothing");
    return value.get<T>();
  }
  std::string at(const char* name) const { return place_ + '/' + name; }

  void expect_end() const {
    if (!members_.empty()) refuse(at(members_.begin().key().c_str()), "there is no such member");
  }

 private:
  json members_;
  std::string place_;
};

std::set<Scope> read_scopes(const json& names, const std::string& place) {
  std::set<Scope> scopes;
  if (!names.is_array()) refuse(place, "a list of scopes has to be here");
  for (const json& name : names) {
    const auto* const found =
        std::ranges::find_if(kScopes, [&](const Choice<Scope>& choice) { return name == choice.name; });
    if (found == std::end(kScopes)) refuse(place, "a scope is read, submit or admin");
    scopes.insert(found->value);
  }
  return scopes;
}

Key read_key(json object, const std::string& place) {
  Members members(std::move(object), place);
  Key key;
  key.id = members.take_text("id");
  if (key.id.empty() || !std::ranges::all_of(key.id, is_alphanumeric)) refuse(place + "/id", "this isn't a key's id");
  key.owner = members.take_text("owner");
  if (!is_owner_name(key.owner)) refuse(place + "/owner", "no owner can be called so");
  key.name = members.take_text("name");
  key.scopes = read_scopes(members.take("scopes"), place + "/scopes");
  key.token_hash = members.take_text("token_hash");
  if (!is_content_hash(key.token_hash)) refuse(place + "/token_hash", "this isn't a hash");
  const auto created = members.take_time("created");
  if (!created) refuse(place + "/created", "a time has to be here");
  key.created = *created;
  key.expires = members.take_time("expires");
  key.revoked = members.take_time("revoked");
  if (json limits = members.take("limits"); !limits.is_null()) {
    Members numbers(std::move(limits), place + "/limits");
    key.limits.requests_per_second = numbers.take_number<double>("requests_per_second");
    if (key.limits.requests_per_second == 0) refuse(place + "/limits/requests_per_second", "0 would be no key");
    key.limits.burst = numbers.take_number<std::uint32_t>("burst");
    key.limits.unfinished_jobs = numbers.take_number<std::uint32_t>("unfinished_jobs");
    key.limits.samples_per_hour = numbers.take_number<std::uint64_t>("samples_per_hour");
    key.limits.stored_bytes = numbers.take_number<std::uint64_t>("stored_bytes");
    numbers.expect_end();
  }
  members.expect_end();
  return key;
}

std::vector<Key> read_keys_of(json document) {
  Members members(std::move(document), "");
  if (members.take("version") != kVersion) refuse("/version", "only version 1 is known");
  json list = members.take("keys");
  if (!list.is_array()) refuse("/keys", "a list has to be here");
  members.expect_end();
  std::vector<Key> keys;
  std::set<std::string> ids;
  for (json& object : list) {
    const std::string place = "/keys/" + std::to_string(keys.size());
    keys.push_back(read_key(std::move(object), place));
    if (!ids.insert(keys.back().id).second) refuse(place + "/id", "another key has it");
  }
  return keys;
}

json to_json(const KeyLimits& limits) {
  json object = json::object();
  const auto add = [&](const char* name, const auto& limit) {
    if (limit) object[name] = *limit;
  };
  add("requests_per_second", limits.requests_per_second);
  add("burst", limits.burst);
  add("unfinished_jobs", limits.unfinished_jobs);
  add("samples_per_hour", limits.samples_per_hour);
  add("stored_bytes", limits.stored_bytes);
  return object;
}

json to_json(const Key& key) {
  json scopes = json::array();
  for (const Scope scope : key.scopes) scopes.push_back(name_of(scope_names(), scope));
  json object{{"id", key.id},
              {"owner", key.owner},
              {"name", key.name},
              {"scopes", std::move(scopes)},
              {"token_hash", key.token_hash},
              {"created", to_text(key.created)}};
  if (key.expires) object["expires"] = to_text(*key.expires);
  if (key.revoked) object["revoked"] = to_text(*key.revoked);
  if (json limits = to_json(key.limits); !limits.empty()) object["limits"] = std::move(limits);
  return object;
}

std::string to_document(const std::vector<Key>& keys) {
  json list = json::array();
  for (const Key& key : keys) list.push_back(to_json(key));
  return json{{"version", kVersion}, {"keys", std::move(list)}}.dump(2) + '\n';
}

// ---- The file.

[[noreturn]] void fail(const std::string& what) { throw std::system_error(errno, std::generic_category(), what); }

/// An open file, closed at the end.
class File {
 public:
  File(const fs::path& path, int flags) : path_(path), fd_(::open(path.c_str(), flags | O_CLOEXEC, 0600)) {
    if (fd_ < 0) fail(path.string());
  }
  ~File() { ::close(fd_); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  void lock() const {
    while (::flock(fd_, LOCK_EX) != 0)
      if (errno != EINTR) fail(path_.string());
  }
  void write(std::string_view text) const {
    while (!text.empty()) {
      const ssize_t written = ::write(fd_, text.data(), text.size());
      if (written < 0 && errno != EINTR) fail(path_.string());
      if (written > 0) text.remove_prefix(static_cast<std::size_t>(written));
    }
  }
  void sync() const {
    if (::fsync(fd_) != 0) fail(path_.string());
  }
  /// Root makes keys for a daemon that isn't root: what lies in its folder has to be its own.
  void give_to_owner_of(const fs::path& folder) const {
    struct stat there {};
    if (::stat(folder.c_str(), &there) != 0) fail(folder.string());
    if (::geteuid() == 0 && ::fchown(fd_, there.st_uid, there.st_gid) != 0) fail(path_.string());
  }

 private:
  const fs::path path_;
  const int fd_;
};

}  // namespace

std::span<const Choice<Scope>> scope_names() { return kScopes; }

bool is_owner_name(std::string_view text) {
  return !text.empty() && text.size() <= kLongestOwner && is_alphanumeric(text.front()) &&
         std::ranges::all_of(text,
                             [](char c) { return is_alphanumeric(c) || c == '-' || c == '.' || c == '_' || c == '@'; });
}

std::string make_token(Key& key) {
  key.id = random_characters(kIdLength);
  std::string token = std::string(kPrefix) + key.id + '_' + random_characters(kSecretLength);
  key.token_hash = content_hash(token);
  return token;
}

std::string_view id_of_token(std::string_view token) {
  const bool has_form = token.size() == kPrefix.size() + kIdLength + 1 + kSecretLength && token.starts_with(kPrefix) &&
                        token[kPrefix.size() + kIdLength] == '_';
  return has_form ? token.substr(kPrefix.size(), kIdLength) : std::string_view{};
}

bool fits(const ContentHash& token_hash, std::string_view token) {
  const ContentHash hash = content_hash(token);
  return hash.size() == token_hash.size() && CRYPTO_memcmp(hash.data(), token_hash.data(), hash.size()) == 0;
}

fs::path key_file(const fs::path& data_dir) { return data_dir / "keys.json"; }

std::vector<Key> read_keys(const fs::path& data_dir) {
  const fs::path path = key_file(data_dir);
  std::error_code error;
  if (!fs::exists(path, error) && !error) return {};
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file) throw std::runtime_error(path.string() + " can't be read");
  json document = json::parse(text, nullptr, false);
  if (document.is_discarded()) throw std::runtime_error(path.string() + " isn't JSON");
  try {
    return read_keys_of(std::move(document));
  } catch (const std::runtime_error& wrong) {
    throw std::runtime_error(path.string() + wrong.what());
  }
}

void change_keys(const fs::path& data_dir, const std::function<void(std::vector<Key>&)>& change) {
  if (!fs::exists(data_dir)) {
    fs::create_directories(data_dir);
    fs::permissions(data_dir, fs::perms::owner_all);
  }
  const File lock(data_dir / "keys.lock", O_RDWR | O_CREAT);
  lock.give_to_owner_of(data_dir);
  lock.lock();
  std::vector<Key> keys = read_keys(data_dir);
  change(keys);
  const fs::path path = key_file(data_dir), written = path.string() + ".new";
  fs::remove(written);  // Left of a crash, maybe with other rights.
  {
    const File file(written, O_WRONLY | O_CREAT | O_EXCL);
    file.give_to_owner_of(data_dir);
    file.write(to_document(keys));
    file.sync();
  }
  fs::rename(written, path);
  File(data_dir, O_RDONLY | O_DIRECTORY).sync();
}

std::string to_text(Key::Time time) {
  const std::time_t seconds = time.time_since_epoch().count();
  std::tm parts{};
  ::gmtime_r(&seconds, &parts);
  char text[64];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts)};
}

}  // namespace tessera::proto
