#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/columns.h"
#include "client/commands/commands.h"
#include "client/failure.h"
#include "proto/wire/key_file.h"

/// `tessera keys`: the keys that a daemon lets in, in its data folder. No server is asked.
namespace tessera::client {
namespace {

using proto::Key;

constexpr const char* kReread = "a daemon that runs reads its keys again on SIGHUP";

struct NewKey {
  Key key;
  std::vector<std::string> scopes{"read", "submit"};
  std::optional<unsigned> days;
};

Key::Time this_second() { return std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now()); }

/// Does something with the files of a data folder; what goes wrong there is a local file's fault.
template <typename Work>
auto with_files(const Work& work) {
  try {
    return work();
  } catch (const Failure&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw Failure(Failure::Kind::local_file, error.what());
  }
}

std::string state_of(const Key& key) {
  if (key.revoked) return "revoked";
  return key.is_valid(this_second()) ? "valid" : "expired";
}

std::string scopes_of(const Key& key) {
  std::string list;
  for (const auto& [name, scope] : proto::scope_names())
    if (key.scopes.contains(scope)) list += (list.empty() ? "" : ",") + std::string(name);
  return list;
}

/// What may be told of a key.
nlohmann::json to_json(const Key& key) {
  nlohmann::json told{{"id", key.id},           {"owner", key.owner},
                      {"name", key.name},       {"scopes", nlohmann::json::array()},
                      {"state", state_of(key)}, {"created", proto::to_text(key.created)}};
  for (const auto& [name, scope] : proto::scope_names())
    if (key.scopes.contains(scope)) told["scopes"].push_back(name);
  if (key.expires) told["expires"] = proto::to_text(*key.expires);
  if (key.revoked) told["revoked"] = proto::to_text(*key.revoked);
  return told;
}

void add_key(Session& session, const std::string& data_dir, const NewKey& wanted) {
  Key key = wanted.key;
  key.created = this_second();
  for (const auto& [name, scope] : proto::scope_names())
    if (std::ranges::find(wanted.scopes, name) != wanted.scopes.end()) key.scopes.insert(scope);
  if (wanted.days) key.expires = key.created + std::chrono::days(*wanted.days);
  const std::string token = with_files([&] {
    std::string made = proto::make_token(key);
    proto::change_keys(data_dir, [&](std::vector<Key>& keys) { keys.push_back(key); });
    return made;
  });
  if (session.json) {
    nlohmann::json answer = to_json(key);
    answer["key"] = token;
    session.print_json(answer);
  } else {
    session.print(token);
  }
  session.note(std::string("this is the only time that the key is shown; ") + kReread);
}

void list_keys(Session& session, const std::string& data_dir) {
  const std::vector<Key> keys = with_files([&] { return proto::read_keys(data_dir); });
  if (session.json) {
    nlohmann::json list = nlohmann::json::array();
    for (const Key& key : keys) list.push_back(to_json(key));
    return session.print_json(list);
  }
  std::size_t width = 5;
  for (const Key& key : keys) width = std::max(width, columns_of(key.owner));
  const auto print_row = [&](const std::string& id, const std::string& owner, const std::string& scopes,
                             const std::string& state, const std::string& created, const std::string& expires,
                             const std::string& name) {
    session.print(padded(id, 12) + "  " + padded(owner, width) + "  " + padded(scopes, 17) + "  " + padded(state, 7) +
                  "  " + padded(created, 20) + "  " + padded(expires, 20) + "  " + name);
  };
  print_row("ID", "OWNER", "SCOPES", "STATE", "CREATED", "EXPIRES", "NAME");
  for (const Key& key : keys)
    print_row(key.id, key.owner, scopes_of(key), state_of(key), proto::to_text(key.created),
              key.expires ? proto::to_text(*key.expires) : "never", key.name);
}

void revoke_key(Session& session, const std::string& data_dir, const std::string& id) {
  with_files([&] {
    proto::change_keys(data_dir, [&](std::vector<Key>& keys) {
      const auto found = std::ranges::find(keys, id, &Key::id);
      if (found == keys.end())
        throw Failure(Failure::Kind::usage, "there is no key '" + id + "'; 'tessera keys list' lists all");
      if (!found->revoked) found->revoked = this_second();
    });
  });
  session.note(kReread);
}

void add_add(CLI::App& keys, Session& session, const std::shared_ptr<std::string>& data_dir) {
  CLI::App* command = keys.add_subcommand("add", "Make a key; it is printed on stdout, once");
  const auto wanted = std::make_shared<NewKey>();
  const auto option = [&](const char* name, auto& value, const char* help) {
    return command->add_option(name, value, help);
  };
  option("--owner", wanted->key.owner, "Whose jobs, scenes and files those are that are made with it")
      ->required()
      ->check([](const std::string& text) {
        return proto::is_owner_name(text) ? std::string() : std::string("takes 1 to 64 letters, digits and - . _ @");
      });
  option("--name", wanted->key.name, "What it is for, for people");
  option("--scope", wanted->scopes, "What it allows: read, submit, admin; several with commas (read,submit)")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember({"read", "submit", "admin"}));
  option("--days", wanted->days, "How long it is valid; for good without it")->check(CLI::Range(1U, 36500U));
  proto::KeyLimits& limits = wanted->key.limits;
  option("--requests-per-second", limits.requests_per_second, "Most requests on average")
      ->check(CLI::Range(0.001, 1e6));
  option("--burst", limits.burst, "Most requests at once")->check(CLI::Range(1U, 1'000'000U));
  option("--unfinished-jobs", limits.unfinished_jobs, "Most jobs of its owner that haven't ended");
  option("--samples-per-hour", limits.samples_per_hour, "Most samples, pixels times samples per pixel");
  option("--stored-bytes", limits.stored_bytes, "Most bytes of its owner's uploaded files (or with a unit: 64MiB)")
      ->transform(CLI::AsSizeValue(true));
  command->callback([&session, data_dir, wanted] { add_key(session, *data_dir, *wanted); });
}

}  // namespace

void add_keys(CLI::App& tool, Session& session) {
  CLI::App* command = tool.add_subcommand("keys", "Make, list and revoke the keys of a daemon, in its data folder");
  const auto data_dir = std::make_shared<std::string>();
  command->add_option("--data-dir", *data_dir, "The daemon's data folder")->envname("TESSERA_DATA_DIR")->required();
  command->require_subcommand(1);
  command->fallthrough();

  add_add(*command, session, data_dir);
  CLI::App* list = command->add_subcommand("list", "List the keys; nothing of them can be used");
  list->callback([&session, data_dir] { list_keys(session, *data_dir); });
  CLI::App* revoke = command->add_subcommand("revoke", "Let a key in no more");
  const auto id = std::make_shared<std::string>();
  revoke->add_option("ID", *id, "The key's id, as the list has it")->required();
  revoke->callback([&session, data_dir, id] { revoke_key(session, *data_dir, *id); });
}

}  // namespace tessera::client
