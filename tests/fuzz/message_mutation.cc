#include "tests/fuzz/message_mutation.h"

#include <google/protobuf/descriptor.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

namespace polyest::internal {
namespace {

// The greatest length of a string that grows by mutation.
constexpr size_t kLongestText = 256;

template <typename Value, size_t kCount>
Value Any(const Value (&values)[kCount], size_t chosen) {
  return values[chosen % kCount];
}

// Sets a field, or an element of a repeated field if `index` is not negative.
#define POLYEST_SET_FIELD(Kind, value)                       \
  (index < 0 ? reflection.Set##Kind(&message, &field, value) \
             : reflection.SetRepeated##Kind(&message, &field, index, value))
#define POLYEST_GET_FIELD(Kind)                      \
  (index < 0 ? reflection.Get##Kind(message, &field) \
             : reflection.GetRepeated##Kind(message, &field, index))

}  // namespace

void MessageMutation::Learn(const Message& message) {
  messages_.push_back(&message);
  const auto& reflection = *message.GetReflection();
  std::vector<const Field*> fields;
  reflection.ListFields(message, &fields);
  for (const Field* field : fields) {
    const int count = field->is_repeated() ? reflection.FieldSize(message, field) : 1;
    for (int i = 0; i < count; ++i) {
      if (field->cpp_type() == Field::CPPTYPE_MESSAGE) {
        Learn(field->is_repeated() ? reflection.GetRepeatedMessage(message, field, i)
                                   : reflection.GetMessage(message, field));
      } else if (field->cpp_type() == Field::CPPTYPE_STRING) {
        words_.push_back(field->is_repeated() ? reflection.GetRepeatedString(message, field, i)
                                              : reflection.GetString(message, field));
      }
    }
  }
}

void MessageMutation::Mutate(Message& message) {
  const Field* field = ChooseField(message);
  if (field == nullptr) return;
  if (field->is_repeated()) {
    MutateRepeated(message, *field);
  } else {
    MutateSingular(message, *field);
  }
}

// Returns a field, mostly one that is set.
const MessageMutation::Field* MessageMutation::ChooseField(const Message& message) {
  std::vector<const Field*> fields;
  message.GetReflection()->ListFields(message, &fields);
  if (!fields.empty() && Choose(4) != 0) return fields[Choose(fields.size())];
  const auto& type = *message.GetDescriptor();
  if (type.field_count() == 0) return nullptr;
  return type.field(static_cast<int>(Choose(static_cast<size_t>(type.field_count()))));
}

void MessageMutation::MutateSingular(Message& message, const Field& field) {
  const auto& reflection = *message.GetReflection();
  const bool has = field.has_presence() && reflection.HasField(message, &field);
  if (has && Choose(8) == 0) {
    reflection.ClearField(&message, &field);
  } else if (field.cpp_type() != Field::CPPTYPE_MESSAGE) {
    MutateElement(message, field, -1);
  } else {
    Message& inner = *reflection.MutableMessage(&message, &field);
    if (!has || Choose(8) == 0) {
      Replace(inner);
    } else {
      Mutate(inner);
    }
  }
}

void MessageMutation::MutateRepeated(Message& message, const Field& field) {
  const auto& reflection = *message.GetReflection();
  const int size = reflection.FieldSize(message, &field);
  const auto any = [&] { return static_cast<int>(Choose(static_cast<size_t>(size))); };
  const size_t what = size == 0 ? 0 : Choose(8);
  switch (what) {
    case 0:
      return AddElement(message, field);
    case 1:
      reflection.SwapElements(&message, &field, any(), any());
      return;
    case 2:
      reflection.SwapElements(&message, &field, any(), size - 1);
      reflection.RemoveLast(&message, &field);
      return;
    default:
      if (field.cpp_type() != Field::CPPTYPE_MESSAGE) return MutateElement(message, field, any());
      return Mutate(*reflection.MutableRepeatedMessage(&message, &field, any()));
  }
}

void MessageMutation::Replace(Message& message) {
  std::vector<const Message*> alike;
  for (const Message* other : messages_) {
    if (other->GetDescriptor() == message.GetDescriptor()) alike.push_back(other);
  }
  if (!alike.empty()) message.CopyFrom(*alike[Choose(alike.size())]);
}

void MessageMutation::AddElement(Message& message, const Field& field) {
  const auto& reflection = *message.GetReflection();
  switch (field.cpp_type()) {
    case Field::CPPTYPE_MESSAGE:
      return Replace(*reflection.AddMessage(&message, &field));
    case Field::CPPTYPE_STRING:
      return reflection.AddString(&message, &field, Text(""));
    case Field::CPPTYPE_DOUBLE:
      return reflection.AddDouble(&message, &field, Double(0));
    case Field::CPPTYPE_INT32:
      return reflection.AddInt32(&message, &field, static_cast<int32_t>(Integer(0)));
    case Field::CPPTYPE_INT64:
      return reflection.AddInt64(&message, &field, Integer(0));
    case Field::CPPTYPE_BOOL:
      return reflection.AddBool(&message, &field, Choose(2) == 0);
    default:
      return;  // the service has no fields of other types
  }
}

void MessageMutation::MutateElement(Message& message, const Field& field, int index) {
  const auto& reflection = *message.GetReflection();
  switch (field.cpp_type()) {
    case Field::CPPTYPE_STRING:
      return POLYEST_SET_FIELD(String, Text(POLYEST_GET_FIELD(String)));
    case Field::CPPTYPE_DOUBLE:
      return POLYEST_SET_FIELD(Double, Double(POLYEST_GET_FIELD(Double)));
    case Field::CPPTYPE_INT32:
      return POLYEST_SET_FIELD(Int32, static_cast<int32_t>(Integer(POLYEST_GET_FIELD(Int32))));
    case Field::CPPTYPE_INT64:
      return POLYEST_SET_FIELD(Int64, Integer(POLYEST_GET_FIELD(Int64)));
    case Field::CPPTYPE_BOOL:
      return POLYEST_SET_FIELD(Bool, !POLYEST_GET_FIELD(Bool));
    case Field::CPPTYPE_ENUM:
      return POLYEST_SET_FIELD(EnumValue, Enumerator(field));
    default:
      return;  // the service has no fields of other types
  }
}

double MessageMutation::Double(double now) {
  using Limits = std::numeric_limits<double>;
  constexpr double kValues[] = {0.0,
                                -0.0,
                                1.0,
                                -1.0,
                                0.5,
                                1e-3,
                                1e3,
                                1e9,
                                1e-9,
                                1e300,
                                1e-300,
                                1.0 / 3,
                                Limits::max(),
                                Limits::min(),
                                Limits::denorm_min(),
                                Limits::infinity(),
                                -Limits::infinity(),
                                Limits::quiet_NaN()};
  const double factor = std::ldexp(1.0, static_cast<int>(Choose(7)) - 3);
  switch (Choose(4)) {
    case 0:
      return Any(kValues, Choose(std::size(kValues)));
    case 1:
      return -now;
    case 2:
      return now * factor;
    default:
      return std::nextafter(now + factor - 1, now);
  }
}

int64_t MessageMutation::Integer(int64_t now) {
  using Limits = std::numeric_limits<int64_t>;
  constexpr int64_t kValues[] = {0,
                                 1,
                                 2,
                                 -1,
                                 7,
                                 12,
                                 100,
                                 1000,
                                 100000,
                                 2147483647,
                                 -2147483648,
                                 4294967296,
                                 Limits::max(),
                                 Limits::min()};
  if (Choose(2) == 0) return Any(kValues, Choose(std::size(kValues)));
  const auto step = static_cast<uint64_t>(Choose(17)) - 8;
  return static_cast<int64_t>(static_cast<uint64_t>(now) + step);
}

int MessageMutation::Enumerator(const Field& field) {
  const auto& type = *field.enum_type();
  if (Choose(8) == 0) return static_cast<int>(Integer(0));
  return type.value(static_cast<int>(Choose(static_cast<size_t>(type.value_count()))))->number();
}

std::string MessageMutation::Text(std::string now) {
  if (!words_.empty() && Choose(2) == 0) return words_[Choose(words_.size())];
  MutateBytesOf(now);
  return now;
}

void MessageMutation::MutateBytesOf(std::string& bytes) {
  const size_t size = bytes.size();
  bytes.resize(std::max(size, kLongestText));
  bytes.resize(mutate_bytes_(reinterpret_cast<uint8_t*>(bytes.data()), size, bytes.size()));
}

}  // namespace polyest::internal
