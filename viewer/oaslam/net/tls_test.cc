#include "oaslam/net/tls.h"

#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <boost/asio/read.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/asio/write.hpp>
#include <filesystem>

#include "expect_input_error.h"
#include "temp_folder.h"
#include "test_server.h"

namespace oaslam {
namespace {

namespace asio = boost::asio;
namespace ssl = asio::ssl;
using asio::ip::tcp;
using testing::MatchesRegex;

ServerOptions SelfSigned(const std::vector<std::string>& hosts = {}) {
  return {.tls_self_signed = true, .hosts = hosts};
}

// Writes the certificate and the key of a context; the key encrypted where there is a password.
void WritePem(const ServerOptions& files, ssl::context& tls, const std::string& password = {}) {
  FILE* file = std::fopen(files.tls_cert.c_str(), "w");
  PEM_write_X509(file, SSL_CTX_get0_certificate(tls.native_handle()));
  std::fclose(file);
  file = std::fopen(files.tls_key.c_str(), "w");
  PEM_write_PrivateKey(file, SSL_CTX_get0_privatekey(tls.native_handle()),
                       password.empty() ? nullptr : EVP_aes_128_cbc(),
                       reinterpret_cast<const unsigned char*>(password.data()),
                       static_cast<int>(password.size()), nullptr, nullptr);
  std::fclose(file);
}

// A client that trusts one certificate only, and wants it to be of this host.
class TlsClient {
 public:
  TlsClient(unsigned short port, const std::string& certificate, const std::string& host)
      : socket_(io_, context_) {
    context_.load_verify_file(certificate);
    socket_.set_verify_mode(ssl::verify_peer);
    socket_.set_verify_callback(ssl::host_name_verification(host));
    socket_.next_layer().connect({asio::ip::address_v4::loopback(), port});
  }
  void Shake() { socket_.handshake(ssl::stream_base::client); }
  std::string Ask(const std::string& request) {
    asio::write(socket_, asio::buffer(request));
    std::string answer;
    boost::system::error_code ended;
    asio::read(socket_, asio::dynamic_buffer(answer), ended);
    return answer;
  }

 private:
  asio::io_context io_;
  ssl::context context_{ssl::context::tls_client};
  ssl::stream<tcp::socket> socket_;
};

class Tls : public testing::Test {
 protected:
  ServerOptions Files() const {
    return {.tls_cert = folder_ / "certificate.pem", .tls_key = folder_ / "key.pem"};
  }
  const TempFolder folder_;
};

TEST_F(Tls, WithoutACertificateThereIsNone) { EXPECT_EQ(MakeTls(ServerOptions()), nullptr); }

TEST_F(Tls, ASelfSignedCertificateIsOfThisRunAndItsHosts) {
  const auto one = MakeTls(SelfSigned({"maps.example"})), other = MakeTls(SelfSigned());
  X509* certificate = SSL_CTX_get0_certificate(one->native_handle());
  for (const char* host : {"localhost", "maps.example"})
    EXPECT_EQ(X509_check_host(certificate, host, 0, 0, nullptr), 1) << host;
  EXPECT_EQ(X509_check_host(certificate, "evil.example", 0, 0, nullptr), 0);
  for (const char* address : {"127.0.0.1", "::1"})
    EXPECT_EQ(X509_check_ip_asc(certificate, address, 0), 1) << address;
  EXPECT_EQ(X509_check_ip_asc(certificate, "192.0.2.1", 0), 0);
  ServerOptions at_address = SelfSigned();
  at_address.address = "192.0.2.1";
  EXPECT_EQ(X509_check_ip_asc(SSL_CTX_get0_certificate(MakeTls(at_address)->native_handle()),
                              "192.0.2.1", 0),
            1);
  EXPECT_LT(X509_cmp_current_time(X509_get0_notBefore(certificate)), 0);
  EXPECT_GT(X509_cmp_current_time(X509_get0_notAfter(certificate)), 0);
  EXPECT_EQ(X509_verify(certificate, X509_get0_pubkey(certificate)), 1);
  EXPECT_THAT(FingerprintOf(*one), MatchesRegex("([0-9A-F][0-9A-F]:){31}[0-9A-F][0-9A-F]"));
  EXPECT_NE(FingerprintOf(*one), FingerprintOf(*other));
  EXPECT_INPUT_ERROR(MakeTls(SelfSigned({"a,b"})), HasSubstr("--host"));
}

TEST_F(Tls, FilesAreUsed) {
  const auto made = MakeTls(SelfSigned());
  WritePem(Files(), *made);
  EXPECT_EQ(FingerprintOf(*MakeTls(Files())), FingerprintOf(*made));
}

TEST_F(Tls, FilesThatCannotBeUsedAreRefused) {
  const ServerOptions files = Files();
  const auto problem = [&] { return InputErrorOf([&] { MakeTls(files); }); };
  const auto of = [](const std::string& path) {
    return AllOf(StartsWith(path + ": "), Not(HasSubstr("\n")));
  };
  EXPECT_THAT(problem(), of(files.tls_cert));  // missing
  WritePem(files, *MakeTls(SelfSigned()));
  const std::string key = folder_.Read("key.pem");
  std::filesystem::remove(files.tls_key);
  EXPECT_THAT(problem(), of(files.tls_key));
  folder_.Write("key.pem", folder_.Read("certificate.pem"));
  EXPECT_THAT(problem(), of(files.tls_key));
  folder_.Write("key.pem", key.substr(0, key.size() / 2));
  EXPECT_THAT(problem(), of(files.tls_key));
  folder_.Write("key.pem", key);
  folder_.Write("certificate.pem",
                "-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n");
  EXPECT_THAT(problem(), of(files.tls_cert));
}

TEST_F(Tls, AKeyOfAnotherCertificateIsRefused) {
  ServerOptions other = Files();
  other.tls_key = folder_ / "other.pem";
  WritePem(other, *MakeTls(SelfSigned()));
  WritePem(Files(), *MakeTls(SelfSigned()));
  EXPECT_INPUT_ERROR(MakeTls(other),
                     AllOf(StartsWith(other.tls_key + ": "), HasSubstr(other.tls_cert)));
}

// It would have to be asked for, and nobody may be there to answer.
TEST_F(Tls, AKeyWithAPasswordIsRefused) {
  WritePem(Files(), *MakeTls(SelfSigned()), "secret");
  ASSERT_THAT(folder_.Read("key.pem"), HasSubstr("ENCRYPTED"));
  EXPECT_INPUT_ERROR(MakeTls(Files()), StartsWith(Files().tls_key + ": "));
}

TEST_F(Tls, AServerIsKnownByItsCertificate) {
  const ServerOptions files = Files();
  WritePem(files, *MakeTls(SelfSigned()));
  const TestServer server(std::make_shared<TestService>(), files);
  const std::string request = Get("/hello", "Connection: close\r\n");
  TlsClient client(server.port(), files.tls_cert, "localhost");
  client.Shake();
  EXPECT_THAT(client.Ask(request), AllOf(StartsWith("HTTP/1.1 200"), EndsWith("/hello ")));
  TlsClient elsewhere(server.port(), files.tls_cert, "maps.example");
  EXPECT_THROW(elsewhere.Shake(), boost::system::system_error);
  EXPECT_THAT(AnswerTo(server, request), Not(HasSubstr("HTTP/")));  // without TLS
  TlsClient again(server.port(), files.tls_cert, "localhost");
  again.Shake();
  EXPECT_THAT(again.Ask(request), StartsWith("HTTP/1.1 200"));
}

TEST_F(Tls, WhoDoesNotShakeHandsIsGivenUp) {
  ServerOptions options = SelfSigned();
  options.patience = std::chrono::milliseconds(100);
  const TestServer server(std::make_shared<TestService>(), options);
  RawClient silent(server.port());
  EXPECT_EQ(silent.ReadAll(), "");
}

}  // namespace
}  // namespace oaslam
