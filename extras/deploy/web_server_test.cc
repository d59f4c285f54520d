#include "extras/deploy/web_server.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <filesystem>
#include <string>
#include <thread>

#include "base/error.h"
#include "base/text.h"
#include "os/file.h"
#include "os/gzip.h"
#include "os/testing.h"

namespace upswing::deploy {
namespace {

namespace fs = std::filesystem;

/// A page, and next to it an unreadable file.
class Page {
 public:
  Page() {
    MakeFolder(page / "agents");
    MakeFolder(page / "folder");
    MakeFolder(page / ".hidden");
    WriteFileAtomically(temp_ / "secret.txt", "secret");
    WriteFileAtomically(page / ".hidden/file.txt", "secret");
    WriteFileAtomically(page / "index.html", "<!doctype html>");
    WriteFileAtomically(page / "folder/index.html", "inside");
    WriteFileAtomically(page / "agents/agents.json", "{}");
    WriteFileAtomically(page / "large.js", std::string(3'000'000, '/'));
    WriteFileAtomically(page / "noise.safetensors", std::string(2'000'000, 'n'));
    fs::create_symlink(temp_ / "secret.txt", page / "link.txt");
    fs::create_symlink(temp_.path(), page / "up");
    fs::create_symlink("folder/index.html", page / "inner.html");
  }

 private:
  TempFolder temp_;

 public:
  const fs::path page = temp_ / "page";
};

/// The answer of `files` to GET.
HttpReply Get(WebFiles& files, const std::string& target, const std::string& fields = "") {
  return files.Answer(ParseHttpRequest("GET " + target + " HTTP/1.1\r\nHost: localhost" + fields));
}

/// The value of a field in an answer's head; empty: none.
std::string FieldOf(const std::string& head, const std::string& name) {
  const size_t at = head.find("\r\n" + name + ": ");
  if (at == std::string::npos) return "";
  const size_t begin = at + name.size() + 4;
  return head.substr(begin, head.find("\r\n", begin) - begin);
}

TEST(WebFiles, FindsFilesAndTheirTypes) {
  const Page page;
  WebFiles files(page.page);
  EXPECT_EQ(*Get(files, "/").body, "<!doctype html>");
  EXPECT_EQ(*Get(files, "/folder/").body, "inside");
  EXPECT_EQ(*Get(files, "//folder//index.html?query").body, "inside");
  EXPECT_EQ(*Get(files, "/inner.html").body, "inside");
  for (const auto& [name, type] : std::initializer_list<std::pair<const char*, const char*>>{
           {"a.html", "text/html; charset=utf-8"},
           {"a.js", "text/javascript; charset=utf-8"},
           {"a.css", "text/css; charset=utf-8"},
           {"a.wasm", "application/wasm"},
           {"a.json", "application/json"},
           {"a.svg", "image/svg+xml"},
           {"a.png", "image/png"},
           {"a.woff2", "font/woff2"},
           {"a.safetensors", "application/octet-stream"},
           {"a.txt", "text/plain; charset=utf-8"},
           {"a.xml", "text/xml; charset=utf-8"},
           {"a.ico", "image/x-icon"},
           {"a.gif", "image/gif"},
           {"a.webm", "video/webm"},
           {"a.webmanifest", "application/manifest+json"},
           {"a", "application/octet-stream"}}) {
    WriteFileAtomically(page.page / name, name);
    const HttpReply reply = Get(files, std::string("/") + name);
    EXPECT_EQ(FieldOf(reply.head, "Content-Type"), type);
    EXPECT_EQ(*reply.body, name);
  }
}

TEST(WebFiles, NothingOutsideTheFolderIsRead) {
  const Page page;
  WebFiles files(page.page);
  for (const char* target :
       {"/../secret.txt", "/%2e%2e/secret.txt", "/..%2fsecret.txt", "/folder/../../secret.txt",
        "/./index.html", "/link.txt", "/up/secret.txt", "/up/page/index.html/../../secret.txt",
        "/.hidden/file.txt", "/folder", "/agents/", "/index.html/", "/none", "//etc/passwd",
        "/%2fetc/passwd", "/..", "/agents/..%2f../secret.txt"}) {
    const HttpReply reply = Get(files, target);
    EXPECT_TRUE(reply.head.starts_with("HTTP/1.1 404 ")) << target << reply.head;
    EXPECT_EQ(*reply.body, "404 Not Found\n") << target;
  }
  // This link leads back into the folder.
  EXPECT_EQ(*Get(files, "/up/page/index.html").body, "<!doctype html>");
}

TEST(WebFiles, AFolderCanBeReplaced) {
  const Page page;
  const TempFolder other;
  WriteFileAtomically(other / "agents.json", "other");
  WebFiles files(page.page);
  EXPECT_EQ(*Get(files, "/agents/agents.json").body, "{}");
  files.Replace("agents", other.path());
  EXPECT_EQ(*Get(files, "/agents/agents.json").body, "other");
  EXPECT_EQ(*Get(files, "//%61gents/agents.json").body, "other");
  EXPECT_EQ(*Get(files, "/folder/index.html").body, "inside");
  EXPECT_TRUE(Get(files, "/agents").head.starts_with("HTTP/1.1 404 "));
  EXPECT_TRUE(Get(files, "/agents/../index.html").head.starts_with("HTTP/1.1 404 "));
}

TEST(WebFiles, CompressesForClientsThatAcceptIt) {
  const Page page;
  WebFiles files(page.page);
  files.Compress();
  const std::string gzip = "\r\nAccept-Encoding: gzip";
  const HttpReply plain = Get(files, "/large.js"), small = Get(files, "/large.js", gzip);
  EXPECT_EQ(plain.body->size(), 3'000'000);
  EXPECT_EQ(FieldOf(plain.head, "Content-Encoding"), "");
  EXPECT_LT(small.body->size(), 10'000);
  EXPECT_EQ(FieldOf(small.head, "Content-Encoding"), "gzip");
  EXPECT_EQ(FieldOf(small.head, "Content-Length"), std::to_string(small.body->size()));
  EXPECT_EQ(*small.body, Gzip(*plain.body));
  EXPECT_EQ(Get(files, "/large.js", gzip).body, small.body);  // kept
  for (const HttpReply& reply : {plain, small}) {
    EXPECT_EQ(FieldOf(reply.head, "Vary"), "Accept-Encoding");
  }
  EXPECT_NE(FieldOf(plain.head, "ETag"), FieldOf(small.head, "ETag"));
  EXPECT_EQ(FieldOf(Get(files, "/noise.safetensors", gzip).head, "Content-Encoding"), "");

  WriteFileAtomically(page.page / "large.js", "built again");
  EXPECT_EQ(Gunzip(*Get(files, "/large.js", gzip).body, "reply"), "built again");
}

TEST(WebFiles, AKnownVersionIsNotSentAgain) {
  const Page page;
  WebFiles files(page.page);
  const HttpReply first = Get(files, "/");
  EXPECT_EQ(FieldOf(first.head, "Cache-Control"), "no-cache");
  const std::string tag = FieldOf(first.head, "ETag");
  for (const std::string& known : {tag, "W/" + tag, "\"x\", " + tag}) {
    const HttpReply again = Get(files, "/", "\r\nIf-None-Match: " + known);
    EXPECT_TRUE(again.head.starts_with("HTTP/1.1 304 ")) << known;
    EXPECT_EQ(again.body, nullptr);
    EXPECT_EQ(FieldOf(again.head, "ETag"), tag);
  }
  WriteFileAtomically(page.page / "index.html", "<!doctype HTML>");
  EXPECT_EQ(*Get(files, "/", "\r\nIf-None-Match: " + tag).body, "<!doctype HTML>");
}

TEST(WebFiles, AFileThatCannotBeReadIsAnError) {
  const Page page;
  WebFiles files(page.page);
  fs::resize_file(page.page / "noise.safetensors", kMostTextBytes + 1);
  EXPECT_TRUE(Get(files, "/noise.safetensors").head.starts_with("HTTP/1.1 500 "));
}

/// A running server, and connections to it.
class WebServerTest : public ::testing::Test {
 protected:
  WebServerTest() : files_(page_.page), server_(files_, 0) {
    thread_ = std::thread([this] { server_.Run([this] { return stopped_.load(); }); });
  }
  ~WebServerTest() override {
    stopped_ = true;
    thread_.join();
  }

  static Descriptor Connect(int port) {
    Descriptor socket(::socket(AF_INET, SOCK_STREAM, 0));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)),
              0);
    return socket;
  }

  Descriptor Connect() const { return Connect(server_.port()); }

  static void Send(const Descriptor& socket, std::string_view text) {
    EXPECT_EQ(send(socket.get(), text.data(), text.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(text.size()));
  }

  /// Everything until the server ends the connection.
  static std::string ReceiveAll(const Descriptor& socket) {
    std::string text;
    std::array<char, 65536> buffer;
    ssize_t size = 0;
    while ((size = recv(socket.get(), buffer.data(), buffer.size(), 0)) > 0) {
      text.append(buffer.data(), static_cast<size_t>(size));
    }
    EXPECT_EQ(size, 0);  // not reset
    return text;
  }

  std::string Exchange(std::string_view text) const {
    const Descriptor socket = Connect();
    Send(socket, text);
    return ReceiveAll(socket);
  }

  Page page_;
  WebFiles files_;
  WebServer server_;
  std::atomic<bool> stopped_{false};
  std::thread thread_;
};

const std::string kLast = " HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";

TEST_F(WebServerTest, SendsLargeFilesWhole) {
  const std::string reply = Exchange("GET /noise.safetensors" + kLast);
  EXPECT_EQ(reply.substr(reply.find("\r\n\r\n") + 4), std::string(2'000'000, 'n'));
  const std::string head = Exchange("HEAD /noise.safetensors" + kLast);
  EXPECT_EQ(head, reply.substr(0, reply.find("\r\n\r\n") + 4));
}

TEST_F(WebServerTest, AConnectionServesSeveralRequests) {
  const std::string get = "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n";
  // All at once; then letter by letter.
  const std::string all = Concat(get, get, "GET /none", kLast);
  const std::string once = Exchange(all);
  const Descriptor socket = Connect();
  for (const char c : all) Send(socket, {&c, 1});
  EXPECT_EQ(ReceiveAll(socket), once);
  size_t pages = 0;
  for (size_t at = 0; (at = once.find("<!doctype html>", at)) != std::string::npos; ++at) ++pages;
  EXPECT_EQ(pages, 2);
  EXPECT_TRUE(once.ends_with("404 Not Found\n"));
}

TEST_F(WebServerTest, RefusesOtherBytesThanRequestsAndContinues) {
  const Descriptor silent = Connect();
  EXPECT_TRUE(Exchange("\r\n\r\n").starts_with("HTTP/1.1 400 "));
  EXPECT_TRUE(Exchange("\x16\x03\x01 TLS\r\n\r\n").starts_with("HTTP/1.1 400 "));
  EXPECT_TRUE(Exchange("GET / HTTP/1.1\r\nHost: example.org\r\n\r\n").starts_with("HTTP/1.1 403 "));
  EXPECT_TRUE(Exchange("POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9\r\n\r\nsome text")
                  .starts_with("HTTP/1.1 405 "));
  const std::string endless(200'000, 'a');
  EXPECT_TRUE(Exchange("GET /" + endless).starts_with("HTTP/1.1 431 "));
  EXPECT_TRUE(Exchange("GET / HTTP/1.1\r\nHost: localhost\r\nA: " + endless + "\r\n\r\n")
                  .starts_with("HTTP/1.1 431 "));
  { const Descriptor gone = Connect(); }
  Send(Connect(), "GET /noise.safetensors HTTP/1.1\r\nHost: localhost\r\n\r\n");  // does not read
  EXPECT_TRUE(Exchange("GET /" + kLast).ends_with("<!doctype html>"));
  Send(silent, "GET /" + kLast);
  EXPECT_TRUE(ReceiveAll(silent).ends_with("<!doctype html>"));
}

TEST_F(WebServerTest, EndsConnectionsThatWaitTooLong) {
  WebServer server(files_, 0, std::chrono::milliseconds(300));
  std::atomic<bool> stopped{false};
  std::thread thread([&] { server.Run([&] { return stopped.load(); }); });
  const Descriptor silent = Connect(server.port()), slow = Connect(server.port());
  EXPECT_EQ(ReceiveAll(silent), "");
  // Letters without an end do not keep it open.
  ssize_t sent = 1;
  for (int i = 0; i < 6000 && sent == 1; ++i) {
    sent = send(slow.get(), "a", 1, MSG_NOSIGNAL);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_EQ(sent, -1);
  stopped = true;
  thread.join();
}

TEST_F(WebServerTest, MoreConnectionsThanItHoldsWait) {
  std::vector<Descriptor> all;
  all.reserve(100);
  for (int i = 0; i < 100; ++i) all.push_back(Connect());
  for (int i = 99; i >= 64; --i) Send(all[static_cast<size_t>(i)], "GET /" + kLast);
  for (int i = 0; i < 64; ++i) Send(all[static_cast<size_t>(i)], "GET /" + kLast);
  for (const Descriptor& each : all) {
    EXPECT_TRUE(ReceiveAll(each).ends_with("<!doctype html>"));
    shutdown(each.get(), SHUT_WR);
  }
}

TEST_F(WebServerTest, TakesTheNextFreePortOrTheGivenOne) {
  EXPECT_GE(server_.port(), WebServer::kUsualPort);
  EXPECT_GT(WebServer(files_, 0).port(), server_.port());
  try {
    const WebServer second(files_, server_.port());
    FAIL() << "expected an error";
  } catch (const Error& error) {
    EXPECT_EQ(error.exit_code(), 1);
    EXPECT_EQ(error.what(), "port " + std::to_string(server_.port()) + " is already in use");
  }
}

TEST_F(WebServerTest, ListensOnThisMachineOnly) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(server_.port()));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK + 1);  // 127.0.0.2, another address of ours
  const Descriptor socket(::socket(AF_INET, SOCK_STREAM, 0));
  EXPECT_NE(connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
}

}  // namespace
}  // namespace upswing::deploy
