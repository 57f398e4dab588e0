#pragma once

#include <unistd.h>

#include <utility>

namespace polyest::internal {

// Owns a descriptor and closes it when it goes.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor() {
    if (number_ >= 0) close(number_);
  }

  // Returns the descriptor; below 0 where the system has given none.
  int number() const { return number_; }

 private:
  int number_;
};

}  // namespace polyest::internal
