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
    usage,        ///< What was asked for isn't clear.
    refused,      ///< The server answered with a problem.
    unreachable,  ///< No server there, or it stopped answering.
    untrusted,    ///< There is one, but nobody says that it is the one that is meant.
    local_file,   ///< A file here can't be read or written, or may not be sent.
  };

  Failure(Kind kind, const std::string& message, std::vector<proto::FieldError> errors = {}, std::string code = {})
      : std::runtime_error(message), kind_(kind), errors_(std::move(errors)), code_(std::move(code)) {}

  Kind kind() const { return kind_; }

  /// What is wrong with a document, or which jobs were meant, place by place.
  const std::vector<proto::FieldError>& errors() const { return errors_; }

  /// The server's code for what it refuses (proto/wire/problem.h); empty where there is none.
  const std::string& code() const { return code_; }

 private:
  Kind kind_;
  std::vector<proto::FieldError> errors_;
  std::string code_;
};

}  // namespace tessera::client
