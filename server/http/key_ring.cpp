#include "server/http/key_ring.h"

#include <utility>

#include "server/http/http_syntax.h"

namespace tessera::server {
using proto::Problem;
using proto::ProblemCode;

namespace {

constexpr std::string_view kScheme = "bearer ";

/// What no token fits, looked at in place of a key that isn't there: an answer takes as long.
const proto::ContentHash kNobodys = "sha256:" + std::string(64, '0');

Problem unauthorized(std::string detail) { return {ProblemCode::unauthorized, std::move(detail), {}}; }

}  // namespace

KeyRing::KeyRing(std::filesystem::path data_dir, bool required) : data_dir_(std::move(data_dir)), is_open_(!required) {
  reload();
}

std::size_t KeyRing::reload() {
  auto keys = std::make_shared<Keys>();
  for (proto::Key& key : proto::read_keys(data_dir_)) {
    const std::string id = key.id;
    keys->emplace(id, std::make_shared<const proto::Key>(std::move(key)));
  }
  const std::lock_guard lock(mutex_);
  if (!keys->empty()) is_open_ = false;
  keys_ = std::move(keys);
  return keys_->size();
}

bool KeyRing::is_open() const {
  const std::lock_guard lock(mutex_);
  return is_open_;
}

proto::Result<Principal> KeyRing::find(std::optional<std::string_view> authorization) const {
  std::shared_ptr<const Keys> keys;
  {
    const std::lock_guard lock(mutex_);
    if (is_open_) return Principal{};
    keys = keys_;
  }
  if (!authorization || !equal_but_for_case(authorization->substr(0, kScheme.size()), kScheme))
    return unauthorized(
        "This server wants a key, sent as Authorization: Bearer tsk_…; who runs it makes one with "
        "`tessera keys add`.");
  const std::string_view token = trimmed(authorization->substr(kScheme.size()));
  const auto found = keys->find(proto::id_of_token(token));
  const bool is_there = found != keys->end();
  const bool is_right = proto::fits(is_there ? found->second->token_hash : kNobodys, token);
  const auto now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
  if (!is_there || !is_right) return unauthorized("There is no such key.");
  const proto::Key& key = *found->second;
  if (!key.is_valid(now))
    return unauthorized("The key " + key.id + (key.revoked ? " has been revoked." : " has expired."));
  return Principal{key.owner, key.scopes, found->second};
}

}  // namespace tessera::server
