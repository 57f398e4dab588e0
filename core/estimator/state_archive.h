#pragma once

// Serialization of Eigen's and the standard containers for cereal. cereal's own headers are not
// used because they allocate whatever size the bytes claim; here no more memory is allocated than
// the bytes can fill. Doubles are kept bit for bit. Reading past the end, or an impossible size,
// throws cereal::Exception.

#include <Eigen/Core>
#include <algorithm>
#include <cereal/archives/portable_binary.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace cereal {

namespace polyest_state {

// Number of elements read at once.
inline constexpr int64_t kPortion = 8192;

template <class Archive>
int64_t LoadSize(Archive& archive) {
  int64_t size = 0;
  archive(size);
  if (size < 0) throw Exception("a size below 0");
  return size;
}

// Reads `size` numbers or characters into a container that stores them contiguously.
template <class Archive, class Container>
void LoadPlain(Archive& archive, int64_t size, Container& container) {
  container.clear();
  for (int64_t first = 0; first < size; first += kPortion) {
    const int64_t count = std::min(kPortion, size - first);
    container.resize(static_cast<size_t>(first + count));
    auto* const begin = container.data() + first;
    archive(binary_data(begin, static_cast<size_t>(count) * sizeof(*begin)));
  }
}

template <class Archive, class Container>
void SavePlain(Archive& archive, const Container& container) {
  archive(static_cast<int64_t>(container.size()));
  archive(binary_data(container.data(), container.size() * sizeof(*container.data())));
}

}  // namespace polyest_state

template <class Archive>
void save(Archive& archive, const std::string& text) {
  polyest_state::SavePlain(archive, text);
}

template <class Archive>
void load(Archive& archive, std::string& text) {
  polyest_state::LoadPlain(archive, polyest_state::LoadSize(archive), text);
}

template <class Archive, class Element>
void save(Archive& archive, const std::vector<Element>& elements) {
  archive(static_cast<int64_t>(elements.size()));
  for (const Element& element : elements) archive(element);
}

template <class Archive, class Element>
void load(Archive& archive, std::vector<Element>& elements) {
  elements.clear();
  const int64_t size = polyest_state::LoadSize(archive);
  for (int64_t i = 0; i < size; ++i) archive(elements.emplace_back());
}

// Each flag is one byte, 0 for false.
template <class Archive>
void save(Archive& archive, const std::vector<bool>& flags) {
  polyest_state::SavePlain(archive, std::vector<uint8_t>(flags.begin(), flags.end()));
}

template <class Archive>
void load(Archive& archive, std::vector<bool>& flags) {
  std::vector<uint8_t> bytes;
  polyest_state::LoadPlain(archive, polyest_state::LoadSize(archive), bytes);
  flags.assign(bytes.begin(), bytes.end());
}

template <class Archive, class Value>
void save(Archive& archive, const std::optional<Value>& value) {
  archive(static_cast<uint8_t>(value ? 1 : 0));
  if (value) archive(*value);
}

template <class Archive, class Value>
void load(Archive& archive, std::optional<Value>& value) {
  uint8_t present = 0;
  archive(present);
  value.reset();
  if (present != 0) archive(value.emplace());
}

// Matrices, vectors and arrays of double: rows, columns, then the elements by column.
template <class Archive, class Derived>
void save(Archive& archive, const Eigen::PlainObjectBase<Derived>& matrix) {
  archive(static_cast<int64_t>(matrix.rows()), static_cast<int64_t>(matrix.cols()));
  archive(binary_data(matrix.data(), static_cast<size_t>(matrix.size()) * sizeof(double)));
}

template <class Archive, class Derived>
void load(Archive& archive, Eigen::PlainObjectBase<Derived>& matrix) {
  constexpr int64_t kMax = int64_t{1} << 31;
  const int64_t rows = polyest_state::LoadSize(archive);
  const int64_t columns = polyest_state::LoadSize(archive);
  if (rows > kMax || columns > kMax) throw Exception("a matrix too large");
  if (Derived::ColsAtCompileTime == 1 && columns != 1) throw Exception("a vector with columns");
  std::vector<double> elements;
  polyest_state::LoadPlain(archive, rows * columns, elements);
  matrix.resize(rows, columns);
  std::copy(elements.begin(), elements.end(), matrix.data());
}

}  // namespace cereal
