#pragma once

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "proto/wire/problem.h"

namespace tessera::client {

/// Why a call couldn't do what it says. Every function of this library that talks to the server or touches a file
/// either does it or throws this.
class Failure : public std::runtime_error {
 public:
  enum class Kind {
    refused,      ///< The server answered with a problem.
    unreachable,  ///< No server there, or it stopped answering.
    local_file,   ///< A file here can't be read or written.
  };

  Failure(Kind kind, const std::string& message, std::vector<proto::FieldError> errors = {})
      : std::runtime_error(message), kind_(kind), errors_(std::move(errors)) {}

  Kind kind() const { return kind_; }

  /// What the server finds wrong with a document; only with `refused`.
  const std::vector<proto::FieldError>& errors() const { return errors_; }

 private:
  Kind kind_;
  std::vector<proto::FieldError> errors_;
};

}  // namespace tessera::client
