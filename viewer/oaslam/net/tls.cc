#include "oaslam/net/tls.h"

#include <fmt/format.h>
#include <openssl/ec.h>
#include <openssl/evp.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>

#include <array>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/host_name.hpp>
#include <cstdint>

#include "oaslam/util/bad_input.h"
#include "oaslam/util/check.h"
#include "oaslam/util/free_by.h"

namespace oaslam {
namespace {

namespace ssl = boost::asio::ssl;

using Key = std::unique_ptr<EVP_PKEY, FreeBy<EVP_PKEY_free>>;
using Certificate = std::unique_ptr<X509, FreeBy<X509_free>>;

// The names of a certificate as OpenSSL takes them: "DNS:localhost,IP:127.0.0.1".
std::string AlternativeNames(const ServerOptions& options) {
  std::string names = "DNS:localhost,IP:127.0.0.1,IP:::1";
  boost::system::error_code error;
  const std::string machine = boost::asio::ip::host_name(error);
  if (!error && !machine.empty()) names += ",DNS:" + machine;
  const auto address = boost::asio::ip::make_address(options.address, error);
  if (!error && !address.is_unspecified() && !address.is_loopback())
    names += ",IP:" + address.to_string();
  for (const std::string& host : options.hosts) names += ",DNS:" + host;
  return names;
}

Certificate SelfSigned(EVP_PKEY* key, const ServerOptions& options) {
  constexpr long kDay = 24 * 60 * 60, kDays = 365;  // longer than any run, and what browsers accept
  Certificate certificate(X509_new());
  OASLAM_CHECK(certificate);
  X509* x509 = certificate.get();
  X509_set_version(x509, 2);  // X.509 version 3
  int64_t serial = 0;
  RAND_bytes(reinterpret_cast<unsigned char*>(&serial), sizeof(serial));
  ASN1_INTEGER_set_int64(X509_get_serialNumber(x509), serial & INT64_MAX);
  X509_gmtime_adj(X509_getm_notBefore(x509), -kDay);
  X509_gmtime_adj(X509_getm_notAfter(x509), kDays * kDay);
  X509_set_pubkey(x509, key);
  X509_NAME* name = X509_get_subject_name(x509);
  X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_ASC,
                             reinterpret_cast<const unsigned char*>("OA-SLAM"), -1, -1, 0);
  X509_set_issuer_name(x509, name);
  const std::unique_ptr<X509_EXTENSION, FreeBy<X509_EXTENSION_free>> names(X509V3_EXT_conf_nid(
      nullptr, nullptr, NID_subject_alt_name, AlternativeNames(options).c_str()));
  if (!names) throw InputError("--host: a name that a certificate cannot have");
  X509_add_ext(x509, names.get(), -1);
  OASLAM_CHECK(X509_sign(x509, key, EVP_sha256()) > 0);
  return certificate;
}

void UseSelfSigned(const ServerOptions& options, ssl::context& tls) {
  const Key key(EVP_EC_gen("P-256"));
  OASLAM_CHECK(key);
  const Certificate certificate = SelfSigned(key.get(), options);
  OASLAM_CHECK(SSL_CTX_use_certificate(tls.native_handle(), certificate.get()) == 1);
  OASLAM_CHECK(SSL_CTX_use_PrivateKey(tls.native_handle(), key.get()) == 1);
}

void UseFiles(const ServerOptions& options, ssl::context& tls) {
  boost::system::error_code error;
  tls.use_certificate_chain_file(options.tls_cert, error);
  if (error) throw BadInput("{}: no certificate in PEM: {}", options.tls_cert, error.message());
  // Without this, OpenSSL would ask the terminal for the password of an encrypted key.
  tls.set_password_callback([](size_t, ssl::context::password_purpose) { return std::string(); });
  tls.use_private_key_file(options.tls_key, ssl::context::pem, error);
  if (error)
    throw BadInput("{}: no key of {} in PEM: {}", options.tls_key, options.tls_cert,
                   error.message());
  if (SSL_CTX_check_private_key(tls.native_handle()) != 1)
    throw BadInput("{}: is not the key of {}", options.tls_key, options.tls_cert);
}

}  // namespace

std::unique_ptr<ssl::context> MakeTls(const ServerOptions& options) {
  if (options.tls_cert.empty() && !options.tls_self_signed) return nullptr;
  auto tls = std::make_unique<ssl::context>(ssl::context::tls_server);
  tls->set_options(ssl::context::default_workarounds | ssl::context::no_compression);
  SSL_CTX_set_min_proto_version(tls->native_handle(), TLS1_2_VERSION);
  if (options.tls_self_signed)
    UseSelfSigned(options, *tls);
  else
    UseFiles(options, *tls);
  return tls;
}

std::string FingerprintOf(ssl::context& tls) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned length = 0;
  X509_digest(SSL_CTX_get0_certificate(tls.native_handle()), EVP_sha256(), digest.data(), &length);
  std::string text;
  for (unsigned i = 0; i < length; ++i) text += fmt::format("{}{:02X}", i ? ":" : "", digest[i]);
  return text;
}

}  // namespace oaslam
