#pragma once

// Carries an exception of a callback past the C library that calls it, which could not unwind.

#include <exception>
#include <utility>

namespace polyest::internal {

class HeldException {
 public:
  // Returns what `callback` returns, or `failure` if it throws. The exception is kept.
  template <class Callback>
  int Guard(int failure, const Callback& callback) {
    try {
      return callback();
    } catch (...) {
      thrown_ = std::current_exception();
      return failure;
    }
  }

  // Throws what was kept, once the library has returned.
  void Rethrow() {
    if (thrown_) std::rethrow_exception(std::exchange(thrown_, nullptr));
  }

 private:
  std::exception_ptr thrown_;
};

}  // namespace polyest::internal
