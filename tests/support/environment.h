// Environment variables that have another value for the length of a test.
#pragma once

#include <cstdlib>
#include <optional>
#include <string>

#include <stdlib.h>

namespace duet::test {

// Sets an environment variable while it lives, for programs that the test starts, and restores the former
// value or absence in its destructor.
class Environment {
 public:
  // Sets the variable `name`, whose text must outlive the object.
  Environment(const char* name, const std::string& value) : name_(name) {
    if (const char* before = std::getenv(name)) before_ = before;
    ::setenv(name, value.c_str(), 1);
  }
  ~Environment() {
    if (before_)
      ::setenv(name_, before_->c_str(), 1);
    else
      ::unsetenv(name_);
  }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  const char* name_;
  std::optional<std::string> before_;  // former value; empty: the variable was not set
};

}  // namespace duet::test
