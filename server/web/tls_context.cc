#include "server/web/tls_context.h"

#include <absl/strings/str_cat.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>

#include <string>
#include <vector>

#include "core/common/status.h"

namespace polyest::internal {
namespace {

using Certificate = std::unique_ptr<X509, decltype(&X509_free)>;

int RefusePassphrase(char*, int, int, void*) { return -1; }

absl::Status Failed(const char* what) {
  const char* const reason = ERR_reason_error_string(ERR_peek_last_error());
  ERR_clear_error();
  return absl::InvalidArgumentError(
      absl::StrCat(what, ": ", reason == nullptr ? "unknown reason" : reason));
}

std::vector<Certificate> Certificates(const std::string& text) {
  std::vector<Certificate> certificates;
  const std::unique_ptr<BIO, decltype(&BIO_free)> in(
      BIO_new_mem_buf(text.data(), static_cast<int>(text.size())), &BIO_free);
  while (X509* const one = PEM_read_bio_X509(in.get(), nullptr, &RefusePassphrase, nullptr)) {
    certificates.emplace_back(one, &X509_free);
  }
  ERR_clear_error();  // the last one is that there are no more
  return certificates;
}

absl::Status UseIdentity(const TlsMaterial& material, SSL_CTX* context) {
  const std::vector<Certificate> chain = Certificates(material.certificate);
  for (size_t i = 0; i < chain.size(); ++i) {
    const bool used = i == 0 ? SSL_CTX_use_certificate(context, chain[i].get()) == 1
                             : SSL_CTX_add1_chain_cert(context, chain[i].get()) == 1;
    if (!used) return Failed("--tls-certificate");
  }
  const std::unique_ptr<BIO, decltype(&BIO_free)> in(
      BIO_new_mem_buf(material.key.data(), static_cast<int>(material.key.size())), &BIO_free);
  const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> key(
      PEM_read_bio_PrivateKey(in.get(), nullptr, &RefusePassphrase, nullptr), &EVP_PKEY_free);
  if (key == nullptr || SSL_CTX_use_PrivateKey(context, key.get()) != 1 ||
      SSL_CTX_check_private_key(context) != 1) {
    return Failed("--tls-key");
  }
  return absl::OkStatus();
}

absl::Status DemandClientCertificates(const std::string& authorities, SSL_CTX* context) {
  for (const Certificate& authority : Certificates(authorities)) {
    if (X509_STORE_add_cert(SSL_CTX_get_cert_store(context), authority.get()) != 1 ||
        SSL_CTX_add_client_CA(context, authority.get()) != 1) {
      return Failed("--tls-client-ca");
    }
  }
  SSL_CTX_set_verify(context, SSL_VERIFY_PEER | SSL_VERIFY_FAIL_IF_NO_PEER_CERT, nullptr);
  return absl::OkStatus();
}

// Chooses HTTP/1.1 where the client offers it among others.
int ChooseHttp(SSL*, const unsigned char** chosen, unsigned char* size,
               const unsigned char* offered, unsigned int offered_size, void*) {
  static constexpr unsigned char kHttp11[] = {8, 'h', 't', 't', 'p', '/', '1', '.', '1'};
  unsigned char* found = nullptr;
  const int result =
      SSL_select_next_proto(&found, size, kHttp11, sizeof(kHttp11), offered, offered_size);
  *chosen = found;
  return result == OPENSSL_NPN_NEGOTIATED ? SSL_TLSEXT_ERR_OK : SSL_TLSEXT_ERR_NOACK;
}

}  // namespace

absl::StatusOr<std::shared_ptr<SSL_CTX>> MakeTlsContext(const TlsMaterial& material) {
  const std::shared_ptr<SSL_CTX> context(SSL_CTX_new(TLS_server_method()), &SSL_CTX_free);
  if (context == nullptr) return Failed("TLS");
  SSL_CTX_set_min_proto_version(context.get(), TLS1_2_VERSION);
  SSL_CTX_set_mode(context.get(),
                   SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER);
  // No session is resumed, because its client was checked by certificates that may have changed.
  SSL_CTX_set_options(context.get(),
                      SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION | SSL_OP_NO_TICKET);
  SSL_CTX_set_session_cache_mode(context.get(), SSL_SESS_CACHE_OFF);
  SSL_CTX_set_alpn_select_cb(context.get(), &ChooseHttp, nullptr);
  POLYEST_RETURN_IF_ERROR(UseIdentity(material, context.get()));
  if (!material.client_ca.empty()) {
    POLYEST_RETURN_IF_ERROR(DemandClientCertificates(material.client_ca, context.get()));
  }
  return context;
}

}  // namespace polyest::internal
