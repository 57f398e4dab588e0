#pragma once

// Encodes values as bytes for the messages between a daemon and its workers. Both are the same
// build on the same machine, so numbers keep their representation in memory. The decoder does not
// trust its input, since an FMU may have overwritten the worker's memory: it never reads past the
// end and never allocates more than the input can fill.
//
// A type is supported if it has a function Fields(archive, value) that lists its members once, for
// both directions.

#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "core/common/types.h"

namespace polyest::internal {

template <class T>
concept PlainValue = std::is_arithmetic_v<T> || std::is_enum_v<T>;

class Encoder {
 public:
  template <class... Values>
  void operator()(const Values&... values) {
    (Put(values), ...);
  }
  std::string TakeBytes() { return std::move(bytes_); }

 private:
  template <PlainValue T>
  void Put(const T& value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(T));
  }
  void Put(const std::string& text) {
    Put(static_cast<uint64_t>(text.size()));
    bytes_.append(text);
  }
  void Put(const Matrix& matrix) {
    Put(static_cast<uint64_t>(matrix.rows()));
    Put(static_cast<uint64_t>(matrix.cols()));
    bytes_.append(reinterpret_cast<const char*>(matrix.data()),
                  static_cast<size_t>(matrix.size()) * sizeof(double));
  }
  template <class T>
  void Put(const std::vector<T>& values) {
    Put(static_cast<uint64_t>(values.size()));
    for (const T& value : values) Put(value);
  }
  template <class... Alternatives>
  void Put(const std::variant<Alternatives...>& variant) {
    Put(static_cast<uint64_t>(variant.index()));
    std::visit([this](const auto& value) { this->Put(value); }, variant);
  }
  template <class T>
  requires std::is_class_v<T>
  void Put(const T& value) {
    // Fields serves both directions and so takes a mutable reference; the encoder does not modify
    // the value.
    Fields(*this, const_cast<T&>(value));
  }

  std::string bytes_;
};

class Decoder {
 public:
  explicit Decoder(std::string bytes) : bytes_(std::move(bytes)) {}

  template <class... Values>
  void operator()(Values&... values) {
    (Get(values), ...);
  }
  // Whether all values could be read so far. Values that could not be read are left unchanged.
  bool ok() const { return ok_; }
  // Whether all values could be read and no bytes are left.
  bool complete() const { return ok_ && position_ == bytes_.size(); }

 private:
  static constexpr uint64_t kMaxRows = uint64_t{1} << 32;  // of a matrix without columns

  size_t left() const { return bytes_.size() - position_; }

  // Returns the next `size` bytes, or nullptr if fewer are left.
  const char* Next(size_t size) {
    ok_ = ok_ && size <= left();
    if (!ok_) return nullptr;
    position_ += size;
    return bytes_.data() + position_ - size;
  }
  // Reads a number of elements, each of which takes at least `bytes_each` bytes.
  size_t Count(size_t bytes_each) {
    uint64_t count = 0;
    Get(count);
    ok_ = ok_ && count <= left() / bytes_each;
    return ok_ ? static_cast<size_t>(count) : 0;
  }

  template <PlainValue T>
  void Get(T& value) {
    if (const char* bytes = Next(sizeof(T))) std::memcpy(&value, bytes, sizeof(T));
  }
  void Get(bool& value) {
    uint8_t byte = 0;
    Get(byte);
    value = byte != 0;
  }
  void Get(std::string& text) {
    const size_t size = Count(1);
    if (const char* bytes = Next(size)) text.assign(bytes, size);
  }
  void Get(Matrix& matrix) {
    uint64_t rows = 0, columns = 0;
    Get(rows);
    Get(columns);
    // A matrix without columns, such as the inputs of a model that has none, still has rows.
    ok_ = ok_ && (columns == 0 ? rows <= kMaxRows : rows <= left() / sizeof(double) / columns);
    if (!ok_) return matrix.resize(0, 0);
    const size_t size = static_cast<size_t>(rows * columns) * sizeof(double);
    if (const char* bytes = Next(size)) {
      matrix.resize(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(columns));
      if (size > 0) std::memcpy(matrix.data(), bytes, size);
    }
  }
  template <class T>
  void Get(std::vector<T>& values) {
    values.clear();
    const size_t count = Count(1);
    for (size_t i = 0; i < count && ok_; ++i) Get(values.emplace_back());
  }
  template <class... Alternatives>
  void Get(std::variant<Alternatives...>& variant) {
    uint64_t index = 0;
    Get(index);
    ok_ = ok_ && index < sizeof...(Alternatives);
    if (ok_) GetAlternative(variant, index, std::index_sequence_for<Alternatives...>());
  }
  template <class Variant, size_t... kIndex>
  void GetAlternative(Variant& variant, uint64_t index, std::index_sequence<kIndex...>) {
    ((index == kIndex ? Get(variant.template emplace<kIndex>()) : void()), ...);
  }
  template <class T>
  requires std::is_class_v<T>
  void Get(T& value) { Fields(*this, value); }

  std::string bytes_;
  size_t position_ = 0;
  bool ok_ = true;
};

}  // namespace polyest::internal
