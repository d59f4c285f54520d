#include "extras/deploy/http.h"

#include <gtest/gtest.h>

#include <string>

namespace upswing::deploy {
namespace {

const std::string kHost = "\r\nHost: localhost:4173";

HttpRequest Get(const std::string& target, const std::string& fields = kHost) {
  return ParseHttpRequest("GET " + target + " HTTP/1.1" + fields);
}

TEST(Http, ParsesARequest) {
  const HttpRequest request =
      Get("/agents/a%20b.json?x=%2e%2e/..", kHost +
                                                "\r\nACCEPT-encoding: br, gzip\r\nX: \t\"y\" \r\n"
                                                "If-None-Match: \"1\", \"2\"");
  EXPECT_EQ(request.refusal, 0);
  EXPECT_EQ(request.path, "/agents/a b.json");
  EXPECT_EQ(request.if_none_match, "\"1\", \"2\"");
  EXPECT_TRUE(request.takes_gzip);
  EXPECT_TRUE(request.keeps_alive);
  EXPECT_FALSE(request.is_head);
  const HttpRequest head = ParseHttpRequest("HEAD / HTTP/1.0" + kHost);
  EXPECT_EQ(head.refusal, 0);
  EXPECT_TRUE(head.is_head);
  EXPECT_FALSE(head.keeps_alive);
  EXPECT_FALSE(head.takes_gzip);
  EXPECT_FALSE(Get("/", kHost + "\r\nConnection: x, Close").keeps_alive);
}

TEST(Http, RefusesMalformedRequests) {
  for (const std::string& text : {std::string(),
                                  std::string("\r\n"),
                                  std::string("GET"),
                                  std::string("GET /"),
                                  std::string("GET / "),
                                  "GET  / HTTP/1.1" + kHost,
                                  "GET / HTTP/1.1 " + kHost,
                                  "GET / x HTTP/1.1" + kHost,
                                  "GET index.html HTTP/1.1" + kHost,
                                  "GET * HTTP/1.1" + kHost,
                                  "GET http://localhost/ HTTP/1.1" + kHost,
                                  "G:T / HTTP/1.1" + kHost,
                                  " / HTTP/1.1" + kHost,
                                  "GET / HTTPS/1.1" + kHost,
                                  "GET /\xC3\xA4 HTTP/1.1" + kHost,
                                  "GET / HTTP/1.1" + kHost + "\r\nno colon",
                                  "GET / HTTP/1.1" + kHost + "\r\n: no name",
                                  "GET / HTTP/1.1" + kHost + "\r\nA : blank before the colon",
                                  "GET / HTTP/1.1" + kHost + "\r\n continues: the line before",
                                  "GET / HTTP/1.1" + kHost + "\r\nA: b\nB: c",
                                  "GET / HTTP/1.1" + kHost + "\r\nA: b\rB: c",
                                  "GET / HTTP/1.1" + kHost + "\r\nA: " + std::string(1, '\0') + "b",
                                  "GET / HTTP/1.1" + kHost + "\r\n\r\nA: b"}) {
    const HttpRequest request = ParseHttpRequest(text);
    EXPECT_EQ(request.refusal, 400) << text;
    EXPECT_FALSE(request.keeps_alive) << text;
  }
}

TEST(Http, RefusesMalformedPaths) {
  for (const char* target :
       {"/%", "/%4", "/%4g", "/%g4", "/%00", "/a%00b", "/%0a", "/%7F", "/%1b[2J", "/%-1", "/% 1"}) {
    EXPECT_EQ(Get(target).refusal, 400) << target;
  }
  EXPECT_EQ(Get("/%41%7a%c3%A4").path, "/Az\xC3\xA4");
  // What the names mean is checked where files are found.
  EXPECT_EQ(Get("/%2e%2E%2f").path, "/../");
}

TEST(Http, AcceptsOnlyTheNamesOfThisMachine) {
  for (const char* host : {"localhost", "LocalHost:4173", "127.0.0.1", "127.0.0.1:80", "[::1]",
                           "[::1]:4173", "localhost:"}) {
    EXPECT_EQ(Get("/", std::string("\r\nHost: ") + host).refusal, 0) << host;
  }
  for (const char* host : {"", "example.org", "localhost.example.org", "example.org:4173",
                           "127.0.0.2", "0.0.0.0", "::1", "[::2]", "localhost:x", "localhost:1:2",
                           "localhost, example.org", "user@localhost", "localhost."}) {
    EXPECT_EQ(Get("/", std::string("\r\nHost: ") + host).refusal, 403) << host;
  }
  EXPECT_EQ(Get("/", "").refusal, 400);
  EXPECT_EQ(Get("/", kHost + kHost).refusal, 400);
  EXPECT_EQ(Get("/", kHost + "\r\nHost: example.org").refusal, 403);
}

TEST(Http, RefusesOtherMethodsVersionsAndBodies) {
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "CONNECT", "get"}) {
    EXPECT_EQ(ParseHttpRequest(std::string(method) + " / HTTP/1.1" + kHost).refusal, 405) << method;
  }
  for (const char* version : {"HTTP/2", "HTTP/1.2", "HTTP/0.9", "HTTP/1.10", "HTTP/"}) {
    EXPECT_EQ(ParseHttpRequest(std::string("GET / ") + version + kHost).refusal, 505) << version;
  }
  EXPECT_EQ(Get("/", kHost + "\r\nContent-Length: 0").refusal, 0);
  for (const char* field : {"Content-Length: 1", "content-length: 00", "Content-Length: x",
                            "Transfer-Encoding: chunked"}) {
    EXPECT_EQ(Get("/", kHost + "\r\n" + field).refusal, 413) << field;
  }
}

TEST(Http, KnowsWhoTakesGzip) {
  for (const char* list : {"gzip", "GZIP", "br;q=1, gzip;q=0.5", "*", "gzip;q=1.000", "x,gzip"}) {
    EXPECT_TRUE(Get("/", kHost + "\r\nAccept-Encoding: " + list).takes_gzip) << list;
  }
  for (const char* list :
       {"", "identity", "br", "gzip;q=0", "gzip;q=0.000", "gzip;q=", "gzip;x", "x-gzip"}) {
    EXPECT_FALSE(Get("/", kHost + "\r\nAccept-Encoding: " + list).takes_gzip) << list;
  }
}

TEST(Http, AnswersHaveTheSizeOfTheirBody) {
  HttpRequest request = Get("/");
  const auto body = std::make_shared<const std::string>("text\n");
  HttpReply reply = MakeHttpReply(request, 200, "A: b\r\n", body);
  EXPECT_EQ(reply.head,
            "HTTP/1.1 200 OK\r\nA: b\r\nContent-Length: 5\r\nX-Content-Type-Options: nosniff\r\n"
            "Connection: keep-alive\r\n\r\n");
  EXPECT_EQ(reply.body, body);
  request.is_head = true;
  EXPECT_EQ(MakeHttpReply(request, 200, "A: b\r\n", body).head, reply.head);
  EXPECT_EQ(MakeHttpReply(request, 200, "A: b\r\n", body).body, nullptr);
  reply = MakeHttpError(ParseHttpRequest("PUT / HTTP/1.1" + kHost), 405);
  EXPECT_NE(reply.head.find("\r\nAllow: GET, HEAD\r\n"), std::string::npos);
  EXPECT_NE(reply.head.find("\r\nConnection: close\r\n"), std::string::npos);
  EXPECT_EQ(*reply.body, "405 Method Not Allowed\n");
}

}  // namespace
}  // namespace upswing::deploy
