#pragma once

#include <memory>
#include <set>
#include <string>
#include <string_view>

#include "proto/wire/key_file.h"

namespace tessera::server {

/// Who sends a request. Without keys that is nobody in particular, who may do everything.
struct Principal {
  std::string owner;  ///< Of what comes of the request; empty where there are no keys.
  std::set<proto::Scope> scopes{proto::Scope::read, proto::Scope::submit, proto::Scope::admin};
  std::shared_ptr<const proto::Key> key = nullptr;  ///< The one that was shown, if there are keys.

  bool may(proto::Scope scope) const { return scopes.contains(scope) || scopes.contains(proto::Scope::admin); }
  /// Whether what another request of `whose` has made is there for this one.
  bool sees(std::string_view whose) const { return owner == whose || scopes.contains(proto::Scope::admin); }
};

}  // namespace tessera::server
