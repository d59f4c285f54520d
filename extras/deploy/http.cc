#include "extras/deploy/http.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "base/text.h"

namespace upswing::deploy {
namespace {

constexpr std::array<std::pair<int, const char*>, 10> kReasons{
    {{200, "OK"},
     {304, "Not Modified"},
     {400, "Bad Request"},
     {403, "Forbidden"},
     {404, "Not Found"},
     {405, "Method Not Allowed"},
     {413, "Content Too Large"},
     {431, "Request Header Fields Too Large"},
     {500, "Internal Server Error"},
     {505, "HTTP Version Not Supported"}}};

const char* ReasonOf(int status) {
  const auto* found = std::ranges::find(kReasons, status, &std::pair<int, const char*>::first);
  return found == kReasons.end() ? "" : found->second;
}

bool IsControl(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; }
bool IsVisible(char c) { return c > ' ' && c < 0x7F; }

/// Whether `c` may be in a method or in the name of a field.
bool IsTokenCharacter(char c) {
  constexpr std::string_view kOthers = "\"(),/:;<=>?@[\\]{}";
  return IsVisible(c) && kOthers.find(c) == std::string_view::npos;
}

bool IsToken(std::string_view text) {
  return !text.empty() && std::ranges::all_of(text, IsTokenCharacter);
}

std::string Lowered(std::string_view text) {
  std::string lowered(text);
  for (char& c : lowered) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lowered;
}

/// The value of a hexadecimal digit; -1 for another character.
int HexValue(char c) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  const size_t value = kDigits.find(Lowered({&c, 1}));
  return value == std::string_view::npos ? -1 : static_cast<int>(value);
}

/// The path of a request's target, decoded; nothing for a malformed one.
std::optional<std::string> PathOf(std::string_view target) {
  if (!target.starts_with('/') || !std::ranges::all_of(target, IsVisible)) return std::nullopt;
  target = target.substr(0, target.find('?'));
  std::string path;
  for (size_t i = 0; i < target.size(); ++i) {
    char c = target[i];
    if (c == '%') {
      if (i + 2 >= target.size()) return std::nullopt;
      const int high = HexValue(target[i + 1]), low = HexValue(target[i + 2]);
      if (high < 0 || low < 0) return std::nullopt;
      c = static_cast<char>(high * 16 + low);
      i += 2;
    }
    if (IsControl(c)) return std::nullopt;
    path += c;
  }
  return path;
}

/// Whether a Host names this machine, with any port.
bool IsOwnHost(std::string_view host) {
  const size_t colon = host.rfind(':');
  if (colon != std::string_view::npos && !host.ends_with(']')) {
    const std::string_view port = host.substr(colon + 1);
    if (!std::ranges::all_of(port, [](char c) { return c >= '0' && c <= '9'; })) return false;
    host = host.substr(0, colon);
  }
  const std::string name = Lowered(host);
  return name == "localhost" || name == "127.0.0.1" || name == "[::1]";
}

/// Whether a list of Accept-Encoding has gzip with a weight other than 0.
bool TakesGzip(std::string_view list) {
  for (const std::string_view entry : Split(list, ',')) {
    const auto parts = Split(entry, ';');
    const std::string name = Lowered(parts.front());
    if (name != "gzip" && name != "*") continue;
    if (parts.size() == 1) return true;
    const auto weight = parts[1].starts_with("q=") ? ParseNumber(parts[1].substr(2)) : std::nullopt;
    return weight && *weight > 0;
  }
  return false;
}

/// Parses `METHOD TARGET HTTP/1.x`. Returns the status that refuses it; 0: none.
int ParseRequestLine(std::string_view line, HttpRequest& request) {
  const size_t first = line.find(' '), last = line.rfind(' ');
  if (first == last) return 400;
  const std::string_view method = line.substr(0, first), version = line.substr(last + 1);
  const auto path = PathOf(line.substr(first + 1, last - first - 1));
  if (!IsToken(method) || !path || !version.starts_with("HTTP/")) return 400;
  if (version != "HTTP/1.1" && version != "HTTP/1.0") return 505;
  if (method != "GET" && method != "HEAD") return 405;
  request.path = *path;
  request.is_head = method == "HEAD";
  request.keeps_alive = version == "HTTP/1.1";
  return 0;
}

/// Parses `NAME: VALUE`; counts fields Host. Returns the status that refuses it; 0: none.
int ParseField(std::string_view line, HttpRequest& request, int& hosts) {
  const size_t colon = line.find(':');
  if (colon == std::string_view::npos || !IsToken(line.substr(0, colon))) return 400;
  const std::string name = Lowered(line.substr(0, colon));
  const std::string_view value = Trim(line.substr(colon + 1));
  if (std::ranges::any_of(value, [](char c) { return IsControl(c) && c != '\t'; })) return 400;
  if (name == "host") {
    ++hosts;
    if (!IsOwnHost(value)) return 403;
  } else if (name == "transfer-encoding" || (name == "content-length" && value != "0")) {
    return 413;  // no request needs a body
  } else if (name == "connection") {
    for (const std::string_view word : Split(value, ',')) {
      if (Lowered(word) == "close") request.keeps_alive = false;
    }
  } else if (name == "accept-encoding") {
    request.takes_gzip = TakesGzip(value);
  } else if (name == "if-none-match") {
    request.if_none_match = value;
  }
  return 0;
}

}  // namespace

HttpRequest ParseHttpRequest(std::string_view text) {
  HttpRequest request;
  int hosts = 0;
  bool is_first = true;
  while (!text.empty() && request.refusal == 0) {
    const size_t end = text.find("\r\n");
    const std::string_view line = text.substr(0, end);
    text = end == std::string_view::npos ? "" : text.substr(end + 2);
    request.refusal = is_first ? ParseRequestLine(line, request) : ParseField(line, request, hosts);
    is_first = false;
  }
  if (request.refusal == 0 && hosts != 1) request.refusal = 400;
  // The rest of a refused request may be anything.
  if (request.refusal != 0) request.keeps_alive = false;
  return request;
}

HttpReply MakeHttpReply(const HttpRequest& request, int status, std::string_view fields,
                        std::shared_ptr<const std::string> body) {
  HttpReply reply;
  reply.keeps_alive = request.keeps_alive;
  reply.head = Concat("HTTP/1.1 ", status, ' ', ReasonOf(status), "\r\n", fields);
  if (body) reply.head += Concat("Content-Length: ", body->size(), "\r\n");
  reply.head += Concat("X-Content-Type-Options: nosniff\r\nConnection: ",
                       reply.keeps_alive ? "keep-alive" : "close", "\r\n\r\n");
  if (!request.is_head) reply.body = std::move(body);
  return reply;
}

HttpReply MakeHttpError(const HttpRequest& request, int status) {
  const auto text =
      std::make_shared<const std::string>(Concat(status, ' ', ReasonOf(status), '\n'));
  return MakeHttpReply(
      request, status,
      Concat("Content-Type: text/plain; charset=utf-8\r\nCache-Control: no-store\r\n",
             status == 405 ? "Allow: GET, HEAD\r\n" : ""),
      text);
}

}  // namespace upswing::deploy
