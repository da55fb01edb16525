// The server beyond the loopback, with a certificate made here.
#include <gtest/gtest.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>

#include <atomic>
#include <filesystem>
#include <memory>
#include <vector>

#include "apps/live/test_wire.hpp"
#include "host/io/io.hpp"

namespace flexor::live {
namespace {

namespace fs = std::filesystem;

// Key and certificate of itself for the name glove.test.
void make_certificate(const fs::path& certificate_path, const fs::path& key_path) {
  const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> key(EVP_EC_gen("P-256"), EVP_PKEY_free);
  const std::unique_ptr<X509, decltype(&X509_free)> certificate(X509_new(), X509_free);
  X509_set_version(certificate.get(), 2);
  ASN1_INTEGER_set(X509_get_serialNumber(certificate.get()), 1);
  X509_gmtime_adj(X509_getm_notBefore(certificate.get()), -60);
  X509_gmtime_adj(X509_getm_notAfter(certificate.get()), 3600);
  X509_set_pubkey(certificate.get(), key.get());
  X509_NAME* name = X509_get_subject_name(certificate.get());
  X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_ASC, reinterpret_cast<const unsigned char*>("glove.test"),
                             -1, -1, 0);
  X509_set_issuer_name(certificate.get(), name);
  X509_EXTENSION* names = X509V3_EXT_conf_nid(nullptr, nullptr, NID_subject_alt_name, "DNS:glove.test");
  X509_add_ext(certificate.get(), names, -1);
  X509_EXTENSION_free(names);
  X509_sign(certificate.get(), key.get(), EVP_sha256());
  const std::unique_ptr<FILE, decltype(&fclose)> certificate_file(fopen(certificate_path.c_str(), "w"),
                                                                  fclose);
  PEM_write_X509(certificate_file.get(), certificate.get());
  const std::unique_ptr<FILE, decltype(&fclose)> key_file(fopen(key_path.c_str(), "w"), fclose);
  PEM_write_PrivateKey(key_file.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr);
}

class SafeWire {
 public:
  explicit SafeWire(unsigned short port)
      : wire_(port),
        context_(SSL_CTX_new(TLS_client_method()), SSL_CTX_free),
        tls_(SSL_new(context_.get()), SSL_free) {
    SSL_set_fd(tls_.get(), wire_.descriptor());
    open = SSL_connect(tls_.get()) == 1;
  }
  bool open = false;
  void put(std::string_view bytes) const {
    SSL_write(tls_.get(), bytes.data(), static_cast<int>(bytes.size()));
  }
  // Until `size` bytes are there, or the end.
  std::string take(std::size_t size) const {
    std::string out;
    char bytes[4096];
    while (out.size() < size) {
      const int count =
          SSL_read(tls_.get(), bytes, static_cast<int>(std::min(sizeof bytes, size - out.size())));
      if (count <= 0) break;
      out.append(bytes, static_cast<std::size_t>(count));
    }
    return out;
  }

 private:
  Wire wire_;
  std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> context_;
  std::unique_ptr<SSL, decltype(&SSL_free)> tls_;
};

class Tls : public testing::Test {
 protected:
  Tls() {
    options.address = "0.0.0.0";
    options.certificate = folder.path() / "certificate.pem";
    options.key = folder.path() / "key.pem";
    make_certificate(options.certificate, options.key);
  }
  std::string refusal() const {
    try {
      Server server(options, {});
    } catch (const io::InputError& error) {
      return error.what();
    }
    return "none";
  }
  io::TemporaryFolder folder;
  ServerOptions options;
};

TEST_F(Tls, ServesBeyondTheLoopback) {
  const Running running(options);
  EXPECT_TRUE(running.server.url().starts_with("https://"));
  const auto ask = [&](const std::string& host, const std::string& more = {}) {
    const SafeWire wire(running.place.port);
    EXPECT_TRUE(wire.open);
    wire.put(fmt::format("GET {} HTTP/1.1\r\nHost: {}\r\n{}Connection: close\r\n\r\n", running.path(""), host,
                         more));
    return status_of(wire.take(1 << 20));
  };
  const int port = running.place.port;
  EXPECT_EQ(ask(fmt::format("127.0.0.1:{}", port)), 200);   // the address that the connection came in on
  EXPECT_EQ(ask(fmt::format("glove.test:{}", port)), 200);  // the name that the certificate vouches for
  EXPECT_EQ(ask(fmt::format("glove.test:{}", port), fmt::format("Origin: https://glove.test:{}\r\n", port)),
            200);
  EXPECT_EQ(ask(fmt::format("glove.test:{}", port), fmt::format("Origin: http://glove.test:{}\r\n", port)),
            403);
  EXPECT_EQ(ask(fmt::format("evil.example:{}", port)), 403);
  EXPECT_EQ(ask(fmt::format(".test:{}", port)), 403);
  EXPECT_EQ(ask("glove.test"), 403);
}

TEST_F(Tls, SocketsWorkThroughIt) {
  std::string heard;
  std::atomic<bool> opened{false};
  std::unique_ptr<Running> running;
  Handlers handlers;
  handlers.opened = [&](Client) { opened = true; };
  handlers.text = [&](Client client, std::string_view text) {
    running->server.send(client, std::string(text) + std::string(100'000, '.'));
  };
  running = std::make_unique<Running>(options, handlers);
  const SafeWire wire(running->place.port);
  wire.put(handshake(running->place));
  std::string head;
  while (!head.ends_with("\r\n\r\n")) {
    const std::string byte = wire.take(1);
    ASSERT_FALSE(byte.empty());
    head += byte;
  }
  EXPECT_EQ(status_of(head), 101);
  EXPECT_TRUE(soon([&] { return opened.load(); }));
  for (int i = 0; i < 5; ++i) {
    wire.put(frame(kText, "hello"));
    const std::string frame = wire.take(10 + 100'005);
    EXPECT_EQ(frame.size(), 100'015U);
    EXPECT_EQ(frame.substr(10, 7), "hello..");
  }
}

TEST_F(Tls, PlainBytesAndSilenceDoNoHarm) {
  const Running running(options);
  Wire plain(running.place.port);
  plain.put(fmt::format("GET {} HTTP/1.1\r\nHost: {}\r\n\r\n", running.path(""), running.place.host));
  EXPECT_EQ(plain.rest().find("HTTP"), std::string::npos);
  std::vector<Wire> idle;
  for (int i = 0; i < 200; ++i) idle.emplace_back(running.place.port);
  const SafeWire wire(running.place.port);
  wire.put(fmt::format("GET {} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", running.path(""),
                       running.place.host));
  EXPECT_EQ(status_of(wire.take(1 << 20)), 200);
}

TEST_F(Tls, SaysWhatIsWrongWithACertificate) {
  const ServerOptions good = options;
  options.key.clear();
  EXPECT_NE(refusal().find("give both"), std::string::npos);
  options = good;
  options.certificate = folder.path() / "none.pem";
  EXPECT_NE(refusal().find("none.pem"), std::string::npos);
  options.certificate = good.key;
  EXPECT_NE(refusal().find("is no certificate"), std::string::npos);
  options = good;
  make_certificate(folder.path() / "other.pem", folder.path() / "other_key.pem");
  options.key = folder.path() / "other_key.pem";
  EXPECT_NE(refusal().find("is not the key of"), std::string::npos);
  options.key = good.certificate;
  EXPECT_NE(refusal().find("is not the key of"), std::string::npos);
}

}  // namespace
}  // namespace flexor::live
