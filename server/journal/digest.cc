#include "server/journal/digest.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <openssl/evp.h>

#include "core/common/check.h"

namespace polyest {

std::string DeterministicBytes(const google::protobuf::Message& message) {
  std::string bytes;
  google::protobuf::io::StringOutputStream stream(&bytes);
  google::protobuf::io::CodedOutputStream coded(&stream);
  coded.SetSerializationDeterministic(true);
  message.SerializeToCodedStream(&coded);
  coded.Trim();
  return bytes;
}

std::string Digest(std::string_view bytes) {
  std::string digest(32, '\0');
  unsigned int length = 0;
  POLYEST_CHECK(EVP_Digest(bytes.data(), bytes.size(),
                           reinterpret_cast<unsigned char*>(digest.data()), &length, EVP_sha256(),
                           nullptr) == 1 &&
                length == digest.size());
  return digest;
}

}  // namespace polyest
